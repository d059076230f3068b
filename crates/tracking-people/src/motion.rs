//! How a person moves: one Kalman filter for each way to move, and how likely each is.
//!
//! This is the interacting multiple model filter of Blom and Bar-Shalom (1988): a person stands, walks on as before, or
//! changes its way, and goes over from one to another at random.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::{exp, ln, sin_cos};
use nalgebra::{Matrix2, Matrix2x4, Matrix4, Vector2, Vector4};

use crate::params::TrackerParams;

/// Standard deviation of the velocity of a person who stands, m/s, on each axis: it sways.
const SWAY: f64 = 0.05;
/// No way to move is ever less likely than that, so that none is excluded for good.
const LEAST_WEIGHT: f64 = 1e-9;

/// What is known of a person's state.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Estimate {
    /// (x, y, vx, vy), map frame.
    pub(crate) state: Vector4<f64>,
    pub(crate) covariance: Matrix4<f64>,
}

impl Estimate {
    pub(crate) fn position(&self) -> Point2 {
        Point2::new(self.state[0], self.state[1])
    }

    pub(crate) fn velocity(&self) -> Point2 {
        Point2::new(self.state[2], self.state[3])
    }

    /// Standard deviation of the position on an axis, metres: the root of the mean of both variances.
    pub(crate) fn sigma(&self) -> f64 {
        (0.5 * (self.covariance[(0, 0)] + self.covariance[(1, 1)])).sqrt()
    }

    /// Mean and covariance of several, each with its probability; the probabilities add up to 1.
    fn mean(each: [(f64, &Self); WAYS.len()]) -> Self {
        let state = each.iter().fold(Vector4::zeros(), |sum, (weight, one)| sum + one.state * *weight);
        let covariance = each.iter().fold(Matrix4::zeros(), |sum, (weight, one)| {
            let off = one.state - state;
            sum + (one.covariance + off * off.transpose()) * *weight
        });
        Self { state, covariance }
    }

    /// `dt` seconds later, if the person moves in such a way.
    fn after(&self, dt: f64, way: Way, params: &TrackerParams) -> Self {
        // The share of the velocity that stays, and the noise of position, both together, and velocity on each axis.
        let (keeps, [pp, pv, vv]) = match way {
            Way::Stands => (0.0, [params.standing_drift * dt, 0.0, SWAY * SWAY]),
            Way::WalksOn => (1.0, white_acceleration(params.steady_acceleration, dt)),
            Way::Changes => (1.0, white_acceleration(params.acceleration, dt)),
        };
        let mut step = Matrix4::identity();
        let mut noise = Matrix4::zeros();
        for (p, v) in [(0, 2), (1, 3)] {
            step[(p, v)] = keeps * dt;
            step[(v, v)] = keeps;
            noise[(p, p)] = pp;
            noise[(v, v)] = vv;
            noise[(p, v)] = pv;
            noise[(v, p)] = pv;
        }
        Self { state: step * self.state, covariance: step * self.covariance * step.transpose() + noise }
    }

    /// Covariance of where it is seen, with standard deviation `sigma`, metres.
    fn innovation(&self, sigma: f64) -> Matrix2<f64> {
        self.covariance.fixed_view::<2, 2>(0, 0) + Matrix2::identity() * (sigma * sigma)
    }

    fn off(&self, position: Point2) -> Vector2<f64> {
        Vector2::new(position.x - self.state[0], position.y - self.state[1])
    }

    /// Squared Mahalanobis distance of a position with standard deviation `sigma`, metres.
    pub(crate) fn distance(&self, position: Point2, sigma: f64) -> f64 {
        let off = self.off(position);
        self.innovation(sigma).try_inverse().map_or(f64::INFINITY, |inverse| off.dot(&(inverse * off)))
    }

    /// Logarithm of the determinant of [`Self::innovation`]: the wider the place, the less likely each point of it.
    pub(crate) fn ln_determinant(&self, sigma: f64) -> f64 {
        ln(self.innovation(sigma).determinant())
    }

    /// Takes in where it is seen; gives the logarithm of how likely that was, up to a constant.
    fn update(&mut self, position: Point2, sigma: f64) -> f64 {
        let unlikely = self.distance(position, sigma) + self.ln_determinant(sigma);
        let Some(inverse) = self.innovation(sigma).try_inverse() else { return f64::NEG_INFINITY };
        let observed = Matrix2x4::new(1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0);
        let gain = self.covariance * observed.transpose() * inverse;
        self.state += gain * self.off(position);
        let kept = Matrix4::identity() - gain * observed;
        // Joseph's form stays symmetric and positive.
        self.covariance =
            kept * self.covariance * kept.transpose() + gain * gain.transpose() * (sigma * sigma);
        -0.5 * unlikely
    }

    fn carry(&mut self, from: Pose2, to: Pose2) {
        let position = to.transform(from.inverse_transform(self.position()));
        let turn = rotation(to.heading - from.heading);
        let velocity = turn * self.state.fixed_view::<2, 1>(2, 0);
        self.state = Vector4::new(position.x, position.y, velocity.x, velocity.y);
        let mut both = Matrix4::zeros();
        both.fixed_view_mut::<2, 2>(0, 0).copy_from(&turn);
        both.fixed_view_mut::<2, 2>(2, 2).copy_from(&turn);
        self.covariance = both * self.covariance * both.transpose();
    }
}

/// Variance of the position on an axis, its covariance with the velocity, and the velocity's variance after `dt`
/// seconds of random acceleration of power `q`.
fn white_acceleration(q: f64, dt: f64) -> [f64; 3] {
    [q * dt * dt * dt / 3.0, q * dt * dt / 2.0, q * dt]
}

/// A way to move.
#[derive(Debug, Clone, Copy)]
enum Way {
    Stands,
    WalksOn,
    Changes,
}

const WAYS: [Way; 3] = [Way::Stands, Way::WalksOn, Way::Changes];

/// How a person moves, as far as it is known.
#[derive(Debug, Clone)]
pub(crate) struct Motion {
    /// In the order of [`WAYS`]: how likely it is, and what is known of a person who moves so.
    each: [(f64, Estimate); WAYS.len()],
    /// Of all of them together.
    whole: Estimate,
}

impl Motion {
    /// Of a person seen for the first time.
    pub(crate) fn new(position: Point2, sigma: f64, params: &TrackerParams) -> Self {
        let each = WAYS.map(|way| {
            let v = if matches!(way, Way::Stands) { SWAY } else { params.velocity_sigma };
            let variances = Vector4::new(sigma * sigma, sigma * sigma, v * v, v * v);
            let estimate = Estimate {
                state: Vector4::new(position.x, position.y, 0.0, 0.0),
                covariance: Matrix4::from_diagonal(&variances),
            };
            (1.0 / WAYS.len() as f64, estimate)
        });
        Self::of(each)
    }

    fn of(each: [(f64, Estimate); WAYS.len()]) -> Self {
        let whole = Estimate::mean(each.each_ref().map(|(weight, one)| (*weight, one)));
        Self { each, whole }
    }

    /// What is known, however the person moves.
    pub(crate) fn estimate(&self) -> &Estimate {
        &self.whole
    }

    /// Goes on for `dt` seconds.
    pub(crate) fn predict(&mut self, dt: f64, params: &TrackerParams) {
        let keeps = exp(-params.change_rate * dt);
        let changes = (1.0 - keeps) / (WAYS.len() - 1) as f64;
        let before = &self.each;
        let next = std::array::from_fn(|to| {
            let joint: [f64; WAYS.len()] =
                std::array::from_fn(|from| before[from].0 * if from == to { keeps } else { changes });
            let weight = joint.iter().sum::<f64>();
            let mixed = Estimate::mean(std::array::from_fn(|from| (joint[from] / weight, &before[from].1)));
            (weight, mixed.after(dt, WAYS[to], params))
        });
        *self = Self::of(next);
    }

    /// Takes in where the person is seen, with standard deviation `sigma`, metres.
    pub(crate) fn update(&mut self, position: Point2, sigma: f64) {
        let likely = self.each.each_mut().map(|(weight, one)| ln(*weight) + one.update(position, sigma));
        let most = likely.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let likely = likely.map(|one| exp(one - most).max(LEAST_WEIGHT));
        let sum = likely.iter().sum::<f64>();
        for ((weight, _), likely) in self.each.iter_mut().zip(likely) {
            *weight = likely / sum;
        }
        *self = Self::of(self.each);
    }

    /// Goes along with a robot that turns out to be at `to` and not at `from`.
    pub(crate) fn carry(&mut self, from: Pose2, to: Pose2) {
        self.each.iter_mut().for_each(|(_, one)| one.carry(from, to));
        self.whole.carry(from, to);
    }
}

pub(crate) fn rotation(angle: f64) -> Matrix2<f64> {
    let (s, c) = sin_cos(angle);
    Matrix2::new(c, -s, s, c)
}

#[cfg(test)]
mod tests {
    use curionav_planning::random::{rng, standard_normal};

    use super::*;

    const SIGMA: f64 = 0.03;

    /// Seconds seen at 10 Hz, each at constant velocity; gives what is known after each scan.
    fn seen(noise: u64, parts: &[(f64, [f64; 2])]) -> (Motion, Vec<Estimate>) {
        let params = TrackerParams::default();
        let (mut random, mut at) = (rng(noise, 1), Point2::default());
        let mut off = || SIGMA * standard_normal(&mut random);
        let mut motion = Motion::new(Point2::new(off(), off()), SIGMA, &params);
        let mut all = Vec::new();
        for (seconds, [vx, vy]) in parts {
            for _ in 0..(seconds * 10.0).round() as usize {
                at = Point2::new(at.x + 0.1 * vx, at.y + 0.1 * vy);
                motion.predict(0.1, &params);
                motion.update(Point2::new(at.x + off(), at.y + off()), SIGMA);
                all.push(*motion.estimate());
            }
        }
        (motion, all)
    }

    fn worst(estimate: &Estimate, at: usize) -> f64 {
        estimate.covariance[(at, at)].max(estimate.covariance[(at + 1, at + 1)]).sqrt()
    }

    /// Root of the mean square over 20 runs.
    fn rms(each: impl Fn(u64) -> f64) -> f64 {
        ((1..=20).map(|noise| each(noise).powi(2)).sum::<f64>() / 20.0).sqrt()
    }

    #[test]
    fn a_person_who_stands_does_not_walk_and_is_known_for_longer_when_unseen() {
        let (stands, walks) = ([(2.0, [0.0, 0.0])], [(2.0, [1.0, 0.0])]);
        // A Kalman filter that takes all people for changing their way has ten times that.
        let speed = rms(|noise| seen(noise, &stands).1[19].velocity().distance(Point2::default()));
        assert!(speed < 0.02, "{speed}");
        let params = TrackerParams::default();
        let unseen = |parts: &[(f64, [f64; 2])]| {
            let mut motion = seen(1, parts).0;
            motion.predict(1.0, &params);
            worst(motion.estimate(), 0)
        };
        assert!(unseen(&stands) < 0.5 * unseen(&walks), "{} {}", unseen(&stands), unseen(&walks));
    }

    #[test]
    fn a_person_who_stops_starts_or_turns_is_known_within_a_second() {
        for [before, after] in [[[1.0, 0.0], [0.0, 0.0]], [[0.0, 0.0], [1.0, 0.0]], [[1.0, 0.0], [0.0, 1.0]]]
        {
            let parts = [(3.0, before), (1.0, after)];
            let truth = Point2::new(after[0], after[1]);
            let at = |scan: usize| rms(|noise| seen(noise, &parts).1[29 + scan].velocity().distance(truth));
            assert!(at(10) < 0.25, "{before:?} to {after:?}: {} m/s", at(10));
            // It is not believed any longer that it goes on.
            let believed = |noise| worst(&seen(noise, &parts).1[29 + 5], 2);
            assert!(rms(believed) > 0.5 * at(5), "{before:?} to {after:?}");
        }
    }

    #[test]
    fn what_a_person_does_is_never_excluded_for_good() {
        // After a minute of standing, and with no changes at all to be expected.
        let params = TrackerParams { change_rate: 0.0, ..TrackerParams::default() };
        let mut motion = Motion::new(Point2::default(), SIGMA, &params);
        for k in 0..700 {
            motion.predict(0.1, &params);
            motion.update(Point2::new(0.1 * f64::from((k - 600).max(0)), 0.0), SIGMA);
            assert!(motion.each.iter().all(|(weight, _)| *weight > 0.0));
        }
        assert!((motion.estimate().velocity().x - 1.0).abs() < 0.1, "{:?}", motion.estimate());
    }
}
