//! Low-variance resampling to the number of particles the belief needs.

use curionav_planning::geometry::Pose2;

use crate::histogram::Histogram;
use crate::kld::sample_size;
use crate::params::LocalizerParams;
use crate::particles::Particles;

/// Visits the indices that systematic resampling draws: `n` equally spaced pointers into the cumulated
/// weights, the first at `start` (in [0, 1)) of a spacing. A particle of weight w is drawn floor(n w)
/// or ceil(n w) times.
pub(crate) fn systematic(weights: &[f64], n: usize, start: f64, mut draw: impl FnMut(usize)) {
    let total: f64 = weights.iter().sum();
    let (mut index, mut cumulated) = (0, weights.first().copied().unwrap_or(0.0));
    for k in 0..n {
        let pointer = (k as f64 + start) / n as f64 * total;
        while cumulated <= pointer && index + 1 < weights.len() {
            index += 1;
            cumulated += weights[index];
        }
        draw(index);
    }
}

/// How many particles to draw. Fox draws one by one until the bins hit ask for no more; with systematic
/// draws the same rule runs in rounds: draw as many as the last round asked for, count bins, until
/// they ask for no more.
pub(crate) fn needed(
    particles: &Particles,
    start: f64,
    params: &LocalizerParams,
    bins: &mut Histogram,
) -> usize {
    let mut n = params.particles_min;
    for _ in 0..ROUNDS {
        bins.clear();
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
}
