//! Weighting particles by a scan: which beams count, and how much the scan is worth.

use curionav_planning::numerics::{exp, ln};

use crate::likelihood_field::{FieldPose, LikelihoodField};
use crate::params::{LaserLikelihood, LocalizerParams};
use crate::particles::Particles;
use crate::scan::Selection;

/// Multiplies the weights by the likelihood of the beams (at least one), to the power `exponent` or
/// less, and normalises. An ambiguous belief is also held against what the beams passed. Returns the exponent used.
pub(crate) fn weigh(
    particles: &mut Particles,
    field: &LikelihoodField,
    seen: &Selection,
    exponent: f64,
    ambiguous: bool,
    params: &LocalizerParams,
) -> f64 {
    let is_prob = params.model == LaserLikelihood::Prob;
    let person = ln(params.person_likelihood) as f32;
    let penalty = ln(params.through_likelihood) as f32;
    // A narrow object may be a person, who is not in the map. The likelier of the two explanations counts, person or
    // map, so that the object lowers the weight of a pose by at most the odds of a person, however many beams met it.
    // A person cannot explain a beam that would have had to pass through an obstacle.
    let log = |i: usize| {
        let pose = field.pose(particles.x[i], particles.y[i], particles.heading[i]);
        let mut scores = seen.ends.iter().map(|end| field.score(pose, end.x as f32, end.y as f32));
        let mut sum = 0.0;
        for piece in &seen.pieces {
            let beams = scores.by_ref().take(piece.beams);
            if piece.narrow && is_prob {
                let floor = person + piece.beams as f32 * field.perfect;
                sum += beams.fold(0.0, |sum, score| sum + score).max(floor);
            } else {
                sum = beams.fold(sum, |sum, score| sum + score);
            }
        }
        if ambiguous && is_prob {
            sum += penalty * through(field, seen, pose) as f32;
        }
        if is_prob { f64::from(sum) } else { ln(1.0 + f64::from(sum)) }
    };
    let floor = params.temper_ess * particles.len() as f64;
    let mut logs: Vec<f64> = (0..particles.len()).map(log).collect();
    let greatest = logs.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
    logs.iter_mut().for_each(|l| *l -= greatest);
    let prior = particles.weight.clone();
    let mut reweigh = |exponent| reweigh(particles, &prior, &logs, exponent, floor);
    if reweigh(exponent) {
        return exponent;
    }
    // Bisection for the greatest exponent that leaves enough particles alive. The prior's own
    // effective size may already be less; then the scan waits for the next resampling.
    let mut low = 0.0;
    let mut high = exponent;
    for _ in 0..BISECTIONS {
        let middle = 0.5 * (low + high);
        if reweigh(middle) { low = middle } else { high = middle }
    }
    reweigh(low);
    low
}

/// Weights from the prior with this exponent; whether the effective size stays at least `floor`.
fn reweigh(particles: &mut Particles, prior: &[f64], logs: &[f64], exponent: f64, floor: f64) -> bool {
    let mut sum = 0.0;
    for ((weight, prior), log) in particles.weight.iter_mut().zip(prior).zip(logs) {
        *weight = prior * exp(exponent * log);
        sum += *weight;
    }
    // The best particle's factor is 1, but its prior may be nothing: then the scan is ignored.
    if sum > f64::MIN_POSITIVE {
        particles.weight.iter_mut().for_each(|w| *w /= sum);
    } else {
        particles.weight.copy_from_slice(prior);
    }
    particles.effective_size() >= floor
}

/// Log-likelihood of the beams at one pose, as [`weigh`] finds it for an ambiguous belief (prob
/// model) before tempering. None if it is not above `least`, which is often known before the slow part.
pub(crate) fn log_likelihood(
    field: &LikelihoodField,
    seen: &Selection,
    pose: FieldPose,
    least: f32,
    params: &LocalizerParams,
) -> Option<f32> {
    let mut ends = seen.ends.iter();
    let mut sum = 0.0;
    for piece in &seen.pieces {
        let score: f32 =
            ends.by_ref().take(piece.beams).map(|e| field.score(pose, e.x as f32, e.y as f32)).sum();
        let floor = ln(params.person_likelihood) as f32 + piece.beams as f32 * field.perfect;
        sum += if piece.narrow { score.max(floor) } else { score };
    }
    let penalty = ln(params.through_likelihood) as f32;
    if sum > least {
        sum += penalty * through(field, seen, pose) as f32;
    }
    (sum > least).then_some(sum)
}

/// Number of beams that would have had to pass through an obstacle.
fn through(field: &LikelihoodField, seen: &Selection, pose: FieldPose) -> usize {
    let from = (seen.laser.x as f32, seen.laser.y as f32);
    seen.free.iter().filter(|to| field.blocked(pose, from, (to.x as f32, to.y as f32))).count()
}

/// Halvings of the exponent's interval: a thousandth of it is fine enough.
const BISECTIONS: usize = 10;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scan::Piece;
    use crate::surfaces::Surfaces;
    use curionav_planning::geometry::{Point2, Pose2};
    use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
    use nalgebra::Matrix3;

    fn wall_map() -> StaticMap {
        // 6 m x 6 m, a wall one cell thick at x = 5.0..5.1
        let cells = (0..60 * 60).map(|i| if i % 60 == 50 { 100 } else { 0 }).collect();
        StaticMap::new(OccupancyGrid::new(60, 60, 0.1, Pose2::default(), cells).unwrap())
    }

    /// Beams of one wide piece.
    fn wall(ends: Vec<Point2>) -> Selection {
        let pieces = vec![Piece { beams: ends.len(), narrow: false }];
        Selection { ends, pieces, ..Selection::default() }
    }

    fn alone(field: &LikelihoodField, seen: &Selection, pose: Pose2) -> f64 {
        let at = field.pose(pose.x, pose.y, pose.heading);
        log_likelihood(field, seen, at, f32::NEG_INFINITY, &LocalizerParams::default()).unwrap().into()
    }

    fn cloud(n: usize) -> Particles {
        let spread = Matrix3::from_diagonal(&nalgebra::Vector3::new(0.25, 0.25, 0.01));
        let mut random = curionav_planning::random::rng(1, 0);
        Particles::draw_gaussian(n, Pose2::new(3.0, 3.0, 0.0), &spread, &mut random)
    }

    #[test]
    fn weights_equal_the_product_over_beams() {
        let (map, params) = (wall_map(), LocalizerParams { temper_ess: 0.0, ..Default::default() });
        let field = LikelihoodField::new(&Surfaces::new(&map), 5.0, &params);
        let ends: Vec<_> = (-4..=4).map(|k| Point2::new(2.0, 0.2 * f64::from(k))).collect();
        let mut p = cloud(50);
        let before = p.clone();
        weigh(&mut p, &field, &wall(ends.clone()), 0.5, false, &params);
        let reference: Vec<f64> = (0..50)
            .map(|i| {
                let pose = Pose2::new(before.x[i], before.y[i], before.heading[i]);
                let product: f64 = ends
                    .iter()
                    .map(|&e| {
                        let end = pose.transform(e);
                        let d = map.grid.locate(end).map_or(2.0, |(c, r)| {
                            // the wall is one cell thick: both its sides are half a cell away
                            (map.to_occupied.cell(map.grid.index(c, r)) - 0.05).abs().min(2.0)
                        });
                        0.95 * (-d * d / 0.08).exp() + 0.01
                    })
                    .product();
                product.sqrt()
            })
            .collect();
        let sum: f64 = reference.iter().sum();
        for (w, r) in p.weight.iter().zip(&reference) {
            assert!((w - r / sum).abs() < 1e-5, "{w} vs {}", r / sum);
        }
    }

    #[test]
    fn a_sharp_scan_leaves_enough_particles() {
        let (map, params) = (wall_map(), LocalizerParams::default());
        let field = LikelihoodField::new(&Surfaces::new(&map), 5.0, &params);
        let ends: Vec<_> = (0..200).map(|k| Point2::new(2.0, 0.013 * f64::from(k) - 1.3)).collect();
        let mut p = cloud(500);
        weigh(&mut p, &field, &wall(ends), 1.0, false, &params);
        let effective = p.effective_size();
        assert!((50.0..60.0).contains(&effective), "{effective}");
        assert!((p.weight.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    }

    #[test]
    fn many_particles_at_once_weigh_what_each_does_alone() {
        let (map, params) = (wall_map(), LocalizerParams { temper_ess: 0.0, ..Default::default() });
        let field = LikelihoodField::new(&Surfaces::new(&map), 5.0, &params);
        let at = |x: f64, y: f64| Point2::new(x, y);
        let seen = Selection {
            ends: vec![at(2.0, -0.3), at(2.0, 0.0), at(1.0, 0.9), at(1.1, 1.0), at(0.5, 2.0)],
            pieces: vec![
                Piece { beams: 2, narrow: false },
                Piece { beams: 2, narrow: true },
                Piece { beams: 1, narrow: true },
            ],
            free: vec![at(1.7, 0.0), at(4.7, 0.5)],
            ..Selection::default()
        };
        let mut p = cloud(80);
        let logs: Vec<f64> =
            (0..p.len()).map(|i| alone(&field, &seen, Pose2::new(p.x[i], p.y[i], p.heading[i]))).collect();
        weigh(&mut p, &field, &seen, 0.5, true, &params);
        let sum: f64 = logs.iter().map(|l| (0.5 * l).exp()).sum();
        for (w, l) in p.weight.iter().zip(&logs) {
            assert!((w - (0.5 * l).exp() / sum).abs() < 1e-5);
        }
    }

    #[test]
    fn a_person_speaks_against_no_pose_by_more_than_the_odds_of_one() {
        let (map, params) = (wall_map(), LocalizerParams { temper_ess: 0.0, ..Default::default() });
        let field = LikelihoodField::new(&Surfaces::new(&map), 5.0, &params);
        let (right, drawn_to_the_wall) = (Pose2::new(2.0, 3.0, 0.0), Pose2::new(3.5, 3.0, 0.0));
        let log = |narrow: bool, pose: Pose2| {
            let ends = vec![Point2::new(1.5, 0.0); 8];
            let seen = Selection { pieces: vec![Piece { beams: 8, narrow }], ends, ..Selection::default() };
            alone(&field, &seen, pose)
        };
        let gain = |narrow| log(narrow, drawn_to_the_wall) - log(narrow, right);
        // ln 10 however many beams; a wall's eight beams tell e^36
        assert!((gain(true) - 10.0_f64.ln()).abs() < 1e-3 + 8.0 * 0.04, "{}", gain(true));
        assert!(gain(false) > 30.0, "{}", gain(false));
    }
}
