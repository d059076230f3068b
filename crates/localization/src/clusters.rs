//! Which cluster of the belief the estimate describes: the heaviest (D9), unless that would be a jump.

use nalgebra::{Matrix3, Vector3};

use curionav_planning::geometry::{Pose2, wrap_angle};
use curionav_planning::numerics::{atan2, sin_cos};

use crate::histogram::Histogram;
use crate::params::LocalizerParams;
use crate::particles::{Motion, Particles};

/// Connected sets of the belief's bins, and the estimate's hold on one of them. While odometry is good an
/// estimate does not jump: a cluster that it does not reach must be the heaviest over several scans on the
/// move to take it over.
#[derive(Default)]
pub(crate) struct Clusters {
    /// Cluster of every particle, named by one of its bins.
    of: Vec<u32>,
    rival: Option<Rival>,
}

/// A cluster beyond the reach of the estimate that has been the heaviest for a while.
#[derive(Debug, Clone, Copy)]
struct Rival {
    pose: Pose2,
    covariance: Matrix3<f64>,
    scans: u32,
    metres: f64,
}

impl Clusters {
    /// Finds the clusters; returns the heaviest.
    pub(crate) fn find(&mut self, p: &Particles, params: &LocalizerParams) -> Option<u32> {
        let mut histogram = Histogram::new(params.bin_position, params.bin_heading);
        self.of = (0..p.len())
            .map(|i| histogram.add(Pose2::new(p.x[i], p.y[i], p.heading[i]), p.weight[i]))
            .collect();
        histogram.connect();
        let heaviest = histogram.heaviest();
        self.of.iter_mut().for_each(|cluster| *cluster = histogram.root(*cluster));
        heaviest
    }

    /// The cluster to report when a scan has been taken in after this motion, given the estimate as odometry
    /// carried it here. None when none is within its reach.
    pub(crate) fn choose(
        &mut self,
        particles: &Particles,
        heaviest: u32,
        estimate: (Pose2, &Matrix3<f64>),
        motion: &Motion,
        params: &LocalizerParams,
    ) -> Option<u32> {
        let (pose, covariance) = moments(particles, |i| self.of[i] == heaviest)?;
        if reaches(estimate.0, estimate.1, pose) {
            self.rival = None;
            return Some(heaviest);
        }
        if self.challenge(pose, &covariance, motion, params) {
            return Some(heaviest);
        }
        self.heaviest_within(particles, estimate.0, estimate.1)
    }

    /// Mean and covariance of a cluster. That of few particles is nothing in some direction, which no estimate is: each
    /// variance is at least that of the grid, of cells of so many metres.
    pub(crate) fn moments(
        &self,
        particles: &Particles,
        cluster: u32,
        cell: f64,
    ) -> Option<(Pose2, Matrix3<f64>)> {
        let (mean, mut covariance) = moments(particles, |i| self.of[i] == cluster)?;
        let position = cell * cell / 12.0;
        let least = Vector3::new(position, position, LEAST_HEADING_SIGMA * LEAST_HEADING_SIGMA);
        if (0..3).any(|k| covariance[(k, k)] < least[k]) {
            covariance += Matrix3::from_diagonal(&least);
        }
        Some((mean, covariance))
    }

    /// Mean and covariance of all particles outside of a cluster; None if there are none.
    pub(crate) fn moments_outside(
        &self,
        particles: &Particles,
        cluster: Option<u32>,
    ) -> Option<(Pose2, Matrix3<f64>)> {
        moments(particles, |i| self.of.get(i).copied() != cluster)
    }

    pub(crate) fn weight(&self, particles: &Particles, cluster: u32) -> f64 {
        particles.weight.iter().zip(&self.of).filter(|(_, c)| **c == cluster).map(|(w, _)| w).sum()
    }

    /// The heaviest cluster is out of reach. Whether it now takes over.
    fn challenge(
        &mut self,
        pose: Pose2,
        covariance: &Matrix3<f64>,
        motion: &Motion,
        params: &LocalizerParams,
    ) -> bool {
        let (scans, metres) = match self.rival {
            Some(r) if reaches(r.pose.compose(motion.displacement), &r.covariance, pose) => {
                (r.scans + 1, r.metres + motion.travel)
            }
            _ => (1, 0.0),
        };
        let wins = scans >= params.takeover_scans && metres >= params.takeover_metres;
        self.rival = (!wins).then_some(Rival { pose, covariance: *covariance, scans, metres });
        wins
    }

    fn heaviest_within(&self, particles: &Particles, mean: Pose2, covariance: &Matrix3<f64>) -> Option<u32> {
        let mut sums = vec![[0.0; 5]; self.of.iter().max().map_or(0, |last| *last as usize + 1)];
        for (i, &c) in self.of.iter().enumerate() {
            let w = particles.weight[i];
            let (s, cos) = sin_cos(particles.heading[i]);
            let terms = [w, w * particles.x[i], w * particles.y[i], w * cos, w * s];
            sums[c as usize].iter_mut().zip(terms).for_each(|(sum, term)| *sum += term);
        }
        let within = (0..sums.len()).filter(|c| {
            let [w, x, y, cos, sin] = sums[*c];
            w > 0.0 && reaches(mean, covariance, Pose2::new(x / w, y / w, atan2(sin, cos)))
        });
        within.rev().max_by(|a, b| sums[*a][0].total_cmp(&sums[*b][0])).map(|c| c as u32)
    }
}

/// No heading is known better, radians.
const LEAST_HEADING_SIGMA: f64 = 0.002;
/// Deviations within which a belief reaches.
const REACH: f64 = 4.0;
/// Added to a belief's variance, so that one that is very sure of itself still reaches its neighbours: that
/// of half a histogram bin, m2 and rad2.
const SLACK: [f64; 3] = [0.0625, 0.0625, 0.01];

fn reaches(mean: Pose2, covariance: &Matrix3<f64>, to: Pose2) -> bool {
    let off = Vector3::new(to.x - mean.x, to.y - mean.y, wrap_angle(to.heading - mean.heading));
    let spread = covariance + Matrix3::from_diagonal(&Vector3::from(SLACK));
    spread.try_inverse().is_some_and(|inverse| (off.transpose() * inverse * off)[0] <= REACH * REACH)
}

/// Weighted mean and covariance of the particles for which `belongs` holds. The heading's mean is the
/// direction of the mean unit vector, and deviations of heading are taken the short way round, so
/// that the cross terms with position are right too. None when they carry no weight.
pub(crate) fn moments(
    particles: &Particles,
    belongs: impl Fn(usize) -> bool,
) -> Option<(Pose2, Matrix3<f64>)> {
    let mut total = 0.0;
    let mut x = 0.0;
    let mut y = 0.0;
    let mut c = 0.0;
    let mut s = 0.0;
    for i in (0..particles.len()).filter(|&i| belongs(i)) {
        let w = particles.weight[i];
        let (sin, cos) = sin_cos(particles.heading[i]);
        total += w;
        x += w * particles.x[i];
        y += w * particles.y[i];
        c += w * cos;
        s += w * sin;
    }
    if total <= 0.0 {
        return None;
    }
    let mean = Pose2::new(x / total, y / total, atan2(s, c));
    let mut xx = 0.0;
    let mut xy = 0.0;
    let mut xa = 0.0;
    let mut yy = 0.0;
    let mut ya = 0.0;
    let mut aa = 0.0;
    for i in (0..particles.len()).filter(|&i| belongs(i)) {
        let w = particles.weight[i] / total;
        let dx = particles.x[i] - mean.x;
        let dy = particles.y[i] - mean.y;
        let da = wrap_angle(particles.heading[i] - mean.heading);
        xx += w * dx * dx;
        xy += w * dx * dy;
        xa += w * dx * da;
        yy += w * dy * dy;
        ya += w * dy * da;
        aa += w * da * da;
    }
    Some((mean, Matrix3::new(xx, xy, xa, xy, yy, ya, xa, ya, aa)))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn tight() -> Matrix3<f64> {
        Matrix3::from_diagonal(&Vector3::new(0.01, 0.01, 0.001))
    }

    fn drive(metres: f64) -> Motion {
        Motion { displacement: Pose2::new(metres, 0.0, 0.0), travel: metres, turn: 0.0 }
    }

    #[test]
    fn a_belief_reaches_as_far_as_it_is_wide() {
        let (mean, wide) = (Pose2::new(5.0, 5.0, 3.1), Matrix3::from_diagonal(&Vector3::new(4.0, 4.0, 0.1)));
        // sqrt(0.01 + 0.0625) = 0.269; four of them are 1.08 m
        assert!(reaches(mean, &tight(), Pose2::new(6.0, 5.0, 3.1)));
        assert!(!reaches(mean, &tight(), Pose2::new(6.2, 5.0, 3.1)));
        assert!(reaches(mean, &wide, Pose2::new(11.0, 5.0, -3.1)));
        assert!(!reaches(mean, &wide, Pose2::new(5.0, 5.0, 0.0)));
    }

    #[test]
    fn only_a_rival_that_moves_with_the_robot_over_several_scans_takes_over() {
        let params = LocalizerParams::default();
        let mut steady = Clusters::default();
        let answers: Vec<bool> = (0..6)
            .map(|k| {
                steady.challenge(Pose2::new(0.4 * f64::from(k), 9.0, 0.0), &tight(), &drive(0.4), &params)
            })
            .collect();
        // after four scans, of which the last three are 1.2 m of way
        assert_eq!(answers, [false, false, false, true, false, false]);
        let (mut restless, mut standing) = (Clusters::default(), Clusters::default());
        for k in 0..50 {
            let here_and_there = Pose2::new(f64::from(k % 3) * 7.0, 9.0, 0.0);
            assert!(!restless.challenge(here_and_there, &tight(), &drive(0.4), &params));
            assert!(!standing.challenge(Pose2::new(0.0, 9.0, 0.0), &tight(), &drive(0.0), &params));
        }
    }

    #[test]
    fn the_heaviest_within_reach_is_not_the_heaviest_of_all() {
        let mut p = Particles::default();
        for (x, w) in [(0.1, 0.1), (0.2, 0.1), (2.1, 0.15), (20.0, 0.65)] {
            p.push(Pose2::new(x, 0.0, 0.0), w);
        }
        let mut clusters = Clusters::default();
        assert_eq!(clusters.find(&p, &LocalizerParams::default()), Some(2));
        assert!((clusters.weight(&p, 2) - 0.65).abs() < 1e-12);
        let found = |mean| clusters.heaviest_within(&p, mean, &tight());
        assert_eq!(found(Pose2::default()), Some(0));
        assert_eq!(found(Pose2::new(1.5, 0.0, 0.0)), Some(1));
        assert_eq!(found(Pose2::new(10.0, 0.0, 0.0)), None);
    }

    #[test]
    fn headings_on_both_sides_of_pi_average_to_pi() {
        let mut p = Particles::default();
        p.push(Pose2::new(0.0, 0.0, 3.1), 0.5);
        p.push(Pose2::new(2.0, 0.0, -3.1), 0.5);
        let (mean, covariance) = moments(&p, |_| true).unwrap();
        let off = std::f64::consts::PI - 3.1;
        assert!((wrap_angle(mean.heading - std::f64::consts::PI)).abs() < 1e-12);
        assert!((mean.x - 1.0).abs() < 1e-12);
        assert!((covariance[(0, 0)] - 1.0).abs() < 1e-12);
        assert!((covariance[(2, 2)] - off * off).abs() < 1e-12);
        // x grows while the heading passes pi counter-clockwise
        assert!((covariance[(0, 2)] - off).abs() < 1e-12);
        assert!(moments(&p, |_| false).is_none());
    }
}
