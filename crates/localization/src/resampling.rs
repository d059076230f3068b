//! Low-variance resampling to the number of particles the belief needs, by KLD-sampling (Fox, 2003).

use curionav_planning::geometry::Pose2;
use curionav_planning::random::{Rng, standard_normal};

use crate::histogram::Histogram;
use crate::params::LocalizerParams;
use crate::particles::Particles;

/// Visits the indices that systematic resampling draws: `n` equally spaced pointers into the cumulated
/// weights, the first at `start` (in [0, 1)) of a spacing. A particle of weight w is drawn floor(n w)
/// or ceil(n w) times.
pub(crate) fn systematic(weights: &[f64], n: usize, start: f64, mut draw: impl FnMut(usize)) {
    let total: f64 = weights.iter().sum();
    let mut index = 0;
    let mut cumulated = weights.first().copied().unwrap_or(0.0);
    for k in 0..n {
        let pointer = (k as f64 + start) / n as f64 * total;
        while cumulated <= pointer && index + 1 < weights.len() {
            index += 1;
            cumulated += weights[index];
        }
        draw(index);
    }
}

/// `n` particles, drawn by the weights of these from `start` on, each moved a little (roughening, Gordon and others,
/// 1993).
pub(crate) fn roughened(
    particles: &Particles,
    n: usize,
    start: f64,
    params: &LocalizerParams,
    random: &mut Rng,
) -> Particles {
    let position = params.roughening_position;
    let heading = params.roughening_heading;
    let mut drawn = Particles::default();
    systematic(&particles.weight, n, start, |i| {
        let pose = Pose2::new(
            particles.x[i] + position * standard_normal(random),
            particles.y[i] + position * standard_normal(random),
            particles.heading[i] + heading * standard_normal(random),
        );
        drawn.push(pose, 1.0 / n as f64);
    });
    drawn
}

/// `n` particles, drawn by the weights of these.
pub(crate) fn thinned(particles: &Particles, n: usize) -> Particles {
    let mut drawn = Particles::default();
    systematic(&particles.weight, n, 0.5, |i| {
        let pose = Pose2::new(particles.x[i], particles.y[i], particles.heading[i]);
        drawn.push(pose, 1.0 / n as f64);
    });
    drawn
}

/// How many particles to draw. Fox draws one by one until the bins hit ask for no more; with systematic
/// draws the same rule runs in rounds: draw as many as the last round asked for, count bins, until
/// they ask for no more.
pub(crate) fn needed(particles: &Particles, start: f64, params: &LocalizerParams) -> usize {
    let mut n = params.particles_min;
    for _ in 0..ROUNDS {
        let mut bins = Histogram::new(params.bin_position, params.bin_heading);
        systematic(&particles.weight, n, start, |i| {
            bins.add(Pose2::new(particles.x[i], particles.y[i], particles.heading[i]), 0.0);
        });
        let asked = sample_size(bins.len(), params.kld_err, params.kld_z).min(params.particles_max);
        if asked <= n {
            break;
        }
        n = asked;
    }
    n
}

/// Rounds of [`needed`]: each finds fewer new bins than the last.
const ROUNDS: usize = 4;

/// Particles needed so that, with the probability of which `z` is the upper standard normal quantile,
/// the Kullback-Leibler distance between the belief and its particles stays below `err`, when the belief
/// fills `bins` histogram bins (Fox 2003, eq. 7, the Wilson-Hilferty approximation):
///
/// `n = ceil((k-1)/(2 err) * (1 - 2/(9(k-1)) + z sqrt(2/(9(k-1))))^3)`
///
/// With one bin or none the statistic has no degree of freedom and any number will do: 1, which the
/// caller's least number then raises. (ROS `amcl` takes the greatest number there, so that its
/// best-known poses are its most expensive.)
fn sample_size(bins: usize, err: f64, z: f64) -> usize {
    if bins <= 1 {
        return 1;
    }
    let freedom = (bins - 1) as f64;
    let spread = 2.0 / (9.0 * freedom);
    let root = 1.0 - spread + z * spread.sqrt();
    (freedom / (2.0 * err) * root * root * root).ceil() as usize
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::random::{rng, uniform};

    #[test]
    fn every_particle_is_drawn_in_proportion_to_its_weight_within_one() {
        for seed in 0..20 {
            let mut r = rng(seed, 0);
            let raw: Vec<f64> = (0..100).map(|_| uniform(&mut r).powi(4)).collect();
            let total: f64 = raw.iter().sum();
            let weights: Vec<f64> = raw.iter().map(|w| w / total).collect();
            let mut count = vec![0_usize; 100];
            systematic(&weights, 333, uniform(&mut r), |i| count[i] += 1);
            assert_eq!(count.iter().sum::<usize>(), 333);
            for (c, w) in count.iter().zip(&weights) {
                assert!((*c as f64 - 333.0 * w).abs() < 1.0 + 1e-9, "seed {seed}");
            }
        }
    }

    #[test]
    fn even_weights_copy_every_particle_once() {
        let mut drawn = Vec::new();
        systematic(&[0.1; 10], 10, 0.5, |i| drawn.push(i));
        assert_eq!(drawn, (0..10).collect::<Vec<_>>());
    }

    #[test]
    fn table_follows_the_chi_square_quantile() {
        // Exact 0.99 quantiles of chi-square with k - 1 degrees of freedom, from tables; the
        // approximation is within 1.5 % from k = 3 on, and within 3 % at k = 2.
        let exact = [(2, 6.635), (3, 9.210), (5, 13.277), (10, 21.666), (20, 36.191), (31, 50.892)];
        for (k, quantile) in exact {
            let n = sample_size(k, 0.05, 2.326_347_874) as f64;
            let expected = quantile / 0.1;
            let tolerance = if k == 2 { 0.03 } else { 0.015 };
            assert!((n / expected - 1.0).abs() < tolerance, "k {k}: {n} vs {expected}");
        }
    }

    #[test]
    fn table_for_two_to_fifty_bins_is_the_formula_and_grows() {
        let mut last = sample_size(1, 0.05, 2.326_347_874);
        for k in 2..=50_usize {
            // the formula in other words: m [1 - a + z sqrt(a)]^3 / (2 err), a = 2 / (9 m)
            let m = (k - 1) as f64;
            let a = 2.0 / 9.0 / m;
            let reference = (m / 0.1 * (1.0 - a + 2.326_347_874 * a.sqrt()).powi(3)).ceil() as usize;
            let n = sample_size(k, 0.05, 2.326_347_874);
            assert!(n.abs_diff(reference) <= 1 && n > last, "k {k}: {n} vs {reference}");
            last = n;
        }
        // k = 2 by hand: 10 * (1 - 0.2222 + 2.3263 * 0.4714)^3 = 10 * 1.8744^3 = 65.86
        assert_eq!(sample_size(2, 0.05, 2.326_347_874), 66);
        // k = 50 by hand: 490 * (1 - 0.004535 + 2.3263 * 0.067344)^3 = 490 * 1.152130^3 = 749.38
        assert_eq!(sample_size(50, 0.05, 2.326_347_874), 750);
    }
}
