//! Weighting particles by a scan: which beams count, and how much the scan is worth.

use curionav_planning::geometry::Point2;
use curionav_planning::numerics::{exp, ln};

use crate::likelihood_field::{FieldPose, LikelihoodField};
use crate::params::{LaserLikelihood, LocalizerParams};
use crate::particles::Particles;

/// Scores of every (beam, particle) and what is derived from them; storage lives as long as the filter.
#[derive(Default)]
pub(crate) struct Weighting {
    poses: Vec<FieldPose>,
    /// Row per beam, column per particle.
    scores: Vec<f32>,
    total: Vec<f32>,
    log: Vec<f64>,
    prior: Vec<f64>,
    kept: Vec<bool>,
}

impl Weighting {
    pub(crate) fn with_capacity(particles: usize, beams: usize) -> Self {
        Self {
            poses: Vec::with_capacity(particles),
            scores: Vec::with_capacity(particles * beams),
            total: Vec::with_capacity(particles),
            log: Vec::with_capacity(particles),
            prior: Vec::with_capacity(particles),
            kept: Vec::with_capacity(beams),
        }
    }

    /// Multiplies the weights by the likelihood of beams that end at `ends` (robot frame, at least one),
    /// to the power `exponent` or less, and normalises. `skip` lets beams that most of the belief
    /// disagrees with be left out. Returns the exponent used.
    pub(crate) fn apply(
        &mut self,
        particles: &mut Particles,
        field: &LikelihoodField,
        ends: &[Point2],
        exponent: f64,
        skip: bool,
        params: &LocalizerParams,
    ) -> f64 {
        self.look_up(particles, field, ends);
        self.choose_beams(particles, field.agreement(), skip, params);
        self.sum_logs(particles.len(), params.model);
        self.prior.clear();
        self.prior.extend_from_slice(&particles.weight);
        let floor = params.temper_ess * particles.len() as f64;
        if self.reweigh(particles, exponent, floor) {
            return exponent;
        }
        // Bisection for the greatest exponent that leaves enough particles alive. The prior's own
        // effective size may already be less; then the scan waits for the next resampling.
        let (mut low, mut high) = (0.0, exponent);
        for _ in 0..BISECTIONS {
            let middle = 0.5 * (low + high);
            if self.reweigh(particles, middle, floor) { low = middle } else { high = middle }
        }
        self.reweigh(particles, low, floor);
        low
    }

    fn look_up(&mut self, particles: &Particles, field: &LikelihoodField, ends: &[Point2]) {
        self.poses.clear();
        self.poses.extend(
            (0..particles.len()).map(|i| field.pose(particles.x[i], particles.y[i], particles.heading[i])),
        );
        self.scores.clear();
        for end in ends {
            let (x, y) = (end.x as f32, end.y as f32);
            self.scores.extend(self.poses.iter().map(|&pose| field.score(pose, x, y)));
        }
    }

    /// A beam that most of a converged belief disagrees with has met something that is not on the map.
    fn choose_beams(&mut self, particles: &Particles, agreement: f32, skip: bool, params: &LocalizerParams) {
        self.kept.clear();
        for row in self.scores.chunks_exact(particles.len()) {
            let keep = !skip || agreeing(row, &particles.weight, agreement) >= params.beam_skip_threshold;
            self.kept.push(keep);
        }
        let skipped = self.kept.iter().filter(|k| !**k).count();
        if skipped as f64 > params.beam_skip_error_threshold * self.kept.len() as f64 {
            self.kept.fill(true);
        }
    }

    fn sum_logs(&mut self, n: usize, model: LaserLikelihood) {
        self.total.clear();
        self.total.resize(n, 0.0);
        for (row, _) in self.scores.chunks_exact(n).zip(&self.kept).filter(|(_, kept)| **kept) {
            for (sum, score) in self.total.iter_mut().zip(row) {
                *sum += score;
            }
        }
        self.log.clear();
        self.log.extend(self.total.iter().map(|&sum| match model {
            LaserLikelihood::Prob => f64::from(sum),
            LaserLikelihood::Plain => ln(1.0 + f64::from(sum)),
        }));
        let greatest = self.log.iter().fold(f64::NEG_INFINITY, |a, &b| a.max(b));
        self.log.iter_mut().for_each(|l| *l -= greatest);
    }

    /// Weights from the prior with this exponent; whether the effective size stays at least `floor`.
    fn reweigh(&self, particles: &mut Particles, exponent: f64, floor: f64) -> bool {
        let mut sum = 0.0;
        for ((weight, prior), log) in particles.weight.iter_mut().zip(&self.prior).zip(&self.log) {
            *weight = prior * exp(exponent * log);
            sum += *weight;
        }
        // The best particle's factor is 1, but its prior may be nothing: then the scan is ignored.
        if sum > f64::MIN_POSITIVE {
            particles.weight.iter_mut().for_each(|w| *w /= sum);
        } else {
            particles.weight.copy_from_slice(&self.prior);
        }
        particles.effective_size() >= floor
    }
}

/// Share of the weight whose score reaches the threshold.
fn agreeing(row: &[f32], weight: &[f64], threshold: f32) -> f64 {
    row.iter().zip(weight).map(|(&score, &w)| if score >= threshold { w } else { 0.0 }).sum()
}

/// Halvings of the exponent's interval: a thousandth of it is fine enough.
const BISECTIONS: usize = 10;

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::geometry::Pose2;
    use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
    use nalgebra::Matrix3;

    fn wall_map() -> StaticMap {
        // 6 m x 6 m, a wall one cell thick at x = 5.0..5.1
        let cells = (0..60 * 60).map(|i| if i % 60 == 50 { 100 } else { 0 }).collect();
        StaticMap::new(OccupancyGrid::new(60, 60, 0.1, Pose2::default(), cells).unwrap())
    }

    fn cloud(n: usize) -> Particles {
        let mut p = Particles::default();
        let spread = Matrix3::from_diagonal(&nalgebra::Vector3::new(0.25, 0.25, 0.01));
        p.draw_gaussian(n, Pose2::new(3.0, 3.0, 0.0), &spread, &mut curionav_planning::random::rng(1, 0));
        p
    }

    #[test]
    fn weights_equal_the_product_over_beams() {
        let (map, params) = (wall_map(), LocalizerParams { temper_ess: 0.0, ..Default::default() });
        let field = LikelihoodField::new(&map, 5.0, &params);
        let ends: Vec<_> = (-4..=4).map(|k| Point2::new(2.0, 0.2 * f64::from(k))).collect();
        let mut p = cloud(50);
        let before = p.clone();
        Weighting::default().apply(&mut p, &field, &ends, 0.5, false, &params);
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
        let field = LikelihoodField::new(&map, 5.0, &params);
        let ends: Vec<_> = (0..200).map(|k| Point2::new(2.0, 0.013 * f64::from(k) - 1.3)).collect();
        let mut p = cloud(500);
        Weighting::default().apply(&mut p, &field, &ends, 1.0, false, &params);
        let effective = p.effective_size();
        assert!((50.0..60.0).contains(&effective), "{effective}");
        assert!((p.weight.iter().sum::<f64>() - 1.0).abs() < 1e-9);
    }
}
