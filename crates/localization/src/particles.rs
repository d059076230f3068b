//! The particles and how they move.

use nalgebra::{Matrix3, Vector3};

use curionav_planning::geometry::{Pose2, wrap_angle};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::numerics::{hypot, sin_cos};
use curionav_planning::random::{Rng, standard_normal};

/// Weighted pose hypotheses, structure of arrays. Weights sum to 1.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Particles {
    /// Metres.
    pub(crate) x: Vec<f64>,
    /// Metres.
    pub(crate) y: Vec<f64>,
    /// Radians in (-pi, pi].
    pub(crate) heading: Vec<f64>,
    pub(crate) weight: Vec<f64>,
}

/// Motion since some earlier instant, as odometry measured it.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Motion {
    /// New pose in the old robot frame.
    pub(crate) displacement: Pose2,
    /// Distance travelled, metres.
    pub(crate) travel: f64,
    /// Angle turned, radians.
    pub(crate) turn: f64,
}

impl Motion {
    /// From one odometry pose to another. Noise never cancels in a distance or an absolute angle: a
    /// straight drive would seem to turn, and be given the noise of turning. So twice the variance that
    /// the other motion explains is taken off the square.
    pub(crate) fn between(from: Pose2, to: Pose2, noise: &OdometryNoise) -> Self {
        let displacement = from.relative(to);
        let distance = hypot(displacement.x, displacement.y);
        let angle = displacement.heading.abs();
        Self {
            displacement,
            travel: without_noise(distance, noise.position_per_radian * angle),
            turn: without_noise(angle, noise.heading_per_metre * distance),
        }
    }

    pub(crate) fn is_none(&self) -> bool {
        self.displacement == Pose2::default()
    }
}

fn without_noise(measured: f64, variance: f64) -> f64 {
    (measured * measured - 2.0 * variance).max(0.0).sqrt()
}

impl Particles {
    pub(crate) fn len(&self) -> usize {
        self.x.len()
    }

    pub(crate) fn push(&mut self, pose: Pose2, weight: f64) {
        self.x.push(pose.x);
        self.y.push(pose.y);
        self.heading.push(wrap_angle(pose.heading));
        self.weight.push(weight);
    }

    pub(crate) fn draw_gaussian(n: usize, mean: Pose2, covariance: &Matrix3<f64>, random: &mut Rng) -> Self {
        let mut drawn = Self::default();
        (0..n).for_each(|_| drawn.push(normal(mean, covariance, random), 1.0 / n as f64));
        drawn
    }

    /// Moves every particle by the measured motion and a draw of its noise (D6): variances along, across
    /// and of heading that grow with way and turn. The heading's error builds up along the way, so half
    /// of it turns the displacement.
    pub(crate) fn advance(&mut self, motion: &Motion, noise: &OdometryNoise, random: &mut Rng) {
        if motion.is_none() {
            return;
        }
        let sigma = noise.variances(motion.travel, motion.turn).map(f64::sqrt);
        for i in 0..self.len() {
            let heading_error = sigma.z * standard_normal(random);
            let forward = motion.displacement.x + sigma.x * standard_normal(random);
            let left = motion.displacement.y + sigma.y * standard_normal(random);
            let (s, c) = sin_cos(self.heading[i] + 0.5 * heading_error);
            self.x[i] += c * forward - s * left;
            self.y[i] += s * forward + c * left;
            self.heading[i] = wrap_angle(self.heading[i] + motion.displacement.heading + heading_error);
        }
    }

    /// 1 / sum of squared weights: how many equal particles these are worth.
    pub(crate) fn effective_size(&self) -> f64 {
        1.0 / self.weight.iter().map(|w| w * w).sum::<f64>()
    }
}

pub(crate) fn normal(mean: Pose2, covariance: &Matrix3<f64>, random: &mut Rng) -> Pose2 {
    let z = Vector3::new(standard_normal(random), standard_normal(random), standard_normal(random));
    let d = lower_root(covariance) * z;
    Pose2::new(mean.x + d.x, mean.y + d.y, wrap_angle(mean.heading + d.z))
}

/// L with L L' = the covariance, a positive semi-definite matrix. Directions without variance (or with
/// a negative one, from rounding) get none.
fn lower_root(covariance: &Matrix3<f64>) -> Matrix3<f64> {
    let mut l = Matrix3::zeros();
    for j in 0..3 {
        let pivot = covariance[(j, j)] - (0..j).map(|k| l[(j, k)] * l[(j, k)]).sum::<f64>();
        if pivot <= 0.0 {
            continue;
        }
        let root = pivot.sqrt();
        l[(j, j)] = root;
        for i in j + 1..3 {
            let rest = covariance[(i, j)] - (0..j).map(|k| l[(i, k)] * l[(j, k)]).sum::<f64>();
            l[(i, j)] = rest / root;
        }
    }
    l
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::clusters::moments;
    use curionav_planning::random::rng;

    #[test]
    fn draws_have_the_mean_and_covariance_asked_for() {
        let covariance = Matrix3::new(0.2, 0.05, 0.03, 0.05, 0.1, -0.02, 0.03, -0.02, 0.06);
        let p = Particles::draw_gaussian(100_000, Pose2::new(1.0, 2.0, 3.1), &covariance, &mut rng(1, 0));
        let (mean, found) = moments(&p, |_| true).unwrap();
        assert!((mean.x - 1.0).abs() < 0.01 && (mean.y - 2.0).abs() < 0.01);
        assert!(wrap_angle(mean.heading - 3.1).abs() < 0.005);
        assert!((found - covariance).norm() < 0.005, "{found}");
        let exact = (Pose2::new(1.0, 2.0, 0.5), Matrix3::zeros());
        let p = Particles::draw_gaussian(10, exact.0, &exact.1, &mut rng(1, 0));
        assert!(p.x.iter().all(|&x| x == 1.0) && p.heading.iter().all(|&a| a == 0.5));
    }

    #[test]
    fn one_long_step_spreads_like_many_short_ones() {
        let noise = OdometryNoise::default();
        let spread = |steps: u32| {
            let start = Pose2::default();
            let mut p = Particles::draw_gaussian(50_000, start, &Matrix3::zeros(), &mut rng(2, 0));
            let mut random = rng(2, 1);
            let d = 0.4 / f64::from(steps);
            let motion = Motion { displacement: Pose2::new(d, 0.0, 0.0), travel: d, turn: 0.0 };
            for _ in 0..steps {
                p.advance(&motion, &noise, &mut random);
            }
            moments(&p, |_| true).unwrap().1
        };
        let (once, often) = (spread(1), spread(8));
        for k in 0..3 {
            assert!((once[(k, k)] / often[(k, k)] - 1.0).abs() < 0.03, "{once} {often}");
        }
        // 0.4 m * 0.004 m2/m
        assert!((once[(0, 0)] / 0.0016 - 1.0).abs() < 0.03);
        // cov(y, heading) = d/2 * variance of heading
        assert!((once[(1, 2)] / (0.2 * 0.0016) - 1.0).abs() < 0.1, "{once}");
    }
}
