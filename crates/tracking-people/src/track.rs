//! One person over time: whether it is one, where it is and how it moves.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::exp;
use nalgebra::Matrix2;

use crate::motion::{Estimate, Motion, rotation};
use crate::params::TrackerParams;

/// What is known of a person, in the frame of the robot at the time of the scan.
#[derive(Debug, Clone, PartialEq)]
pub struct Person {
    /// The same for as long as the person is followed.
    pub id: u32,
    /// Metres.
    pub position: Point2,
    /// m/s over ground.
    pub velocity: Point2,
    /// Covariance of the position, m2.
    pub position_covariance: Matrix2<f64>,
    /// Covariance of the velocity, m2/s2.
    pub velocity_covariance: Matrix2<f64>,
    /// Seconds since the person was seen last; 0 if in this scan.
    pub age: f64,
    /// How sure it is that this is a person and not a thing, 0.5 to 1.
    pub probability: f64,
}

/// A shape is a person's from so much on, a logarithm: twenty times as likely as a box.
const ROUND: f64 = 3.0;
/// Of what is new a box is known sooner.
const NEW_ROUND: f64 = 1.0;
/// Most that all scans together say of a shape.
const MOST_ROUND: f64 = 20.0;

/// A person who is followed, or something that may become one.
#[derive(Debug, Clone)]
pub(crate) struct Track {
    pub(crate) id: u32,
    motion: Motion,
    /// When it was seen last, seconds.
    pub(crate) seen: f64,
    /// Of the last scans the newest in the lowest bit: whether it was seen.
    history: u32,
    /// Scans since it began.
    scans: u32,
    pub(crate) confirmed: bool,
    /// When and where it was seen first.
    begun: (f64, Point2),
    /// Whether it has walked since.
    has_walked: bool,
    /// How much likelier its shape is that of a person than that of a box, over all scans.
    roundness: f64,
}

impl Track {
    /// Somebody seen for the first time.
    pub(crate) fn new(id: u32, position: Point2, sigma: f64, stamp: f64, params: &TrackerParams) -> Self {
        Self {
            id,
            motion: Motion::new(position, sigma, params),
            seen: stamp,
            history: 1,
            scans: 1,
            confirmed: params.needed() <= 1,
            begun: (stamp, position),
            has_walked: false,
            roundness: 0.0,
        }
    }

    /// What is known of it on the map.
    pub(crate) fn estimate(&self) -> &Estimate {
        self.motion.estimate()
    }

    /// Goes on for `dt` seconds.
    pub(crate) fn predict(&mut self, dt: f64, params: &TrackerParams) {
        self.motion.predict(dt, params);
    }

    /// Takes in where it is seen.
    pub(crate) fn update(&mut self, position: Point2, sigma: f64, stamp: f64, params: &TrackerParams) {
        self.motion.update(position, sigma);
        self.seen = stamp;
        let estimate = self.motion.estimate();
        let speed = estimate.velocity().distance(Point2::default());
        let gone = estimate.position().distance(self.begun.1);
        self.has_walked |= speed >= params.walking && gone >= params.walked;
        self.remember(true, params);
    }

    /// Takes in what its shape in a scan says: nothing is ever so sure that a few scans cannot change it.
    pub(crate) fn take_shape(&mut self, roundness: f64) {
        self.roundness = (self.roundness + roundness).clamp(-MOST_ROUND, MOST_ROUND);
    }

    /// Whether it is a person.
    pub(crate) fn is_person(&self, stamp: f64, params: &TrackerParams) -> bool {
        self.confirmed && self.evidence(stamp, params) > 0.0
    }

    /// How much likelier it is a person than a thing, a logarithm. What walks is one, and for a while what is new,
    /// unless it has the shape of a box: parts of a long one seem to walk along it as the robot does. What stands is
    /// one if it is as round as one.
    fn evidence(&self, stamp: f64, params: &TrackerParams) -> f64 {
        let is_new = stamp - self.begun.0 < params.standing;
        let least = match (self.has_walked, is_new) {
            (true, _) => -ROUND,
            (false, true) => -NEW_ROUND,
            (false, false) => ROUND,
        };
        self.roundness - least
    }

    /// Takes note that it is not seen.
    pub(crate) fn miss(&mut self, params: &TrackerParams) {
        self.remember(false, params);
    }

    fn remember(&mut self, seen: bool, params: &TrackerParams) {
        let all = 1_u32.checked_shl(params.confirm_of).map_or(u32::MAX, |bit| bit - 1);
        self.history = (self.history << 1 | u32::from(seen)) & all;
        self.scans = self.scans.saturating_add(1);
        self.confirmed |= self.history.count_ones() >= params.needed();
    }

    /// Whether something that is no person yet cannot become one with what has been seen of it.
    pub(crate) fn is_hopeless(&self, params: &TrackerParams) -> bool {
        let misses = self.scans.min(params.confirm_of) - self.history.count_ones().min(self.scans);
        !self.confirmed && misses > params.confirm_of - params.needed()
    }

    /// Goes along with a robot that turns out to be at `to` and not at `from`.
    pub(crate) fn carry(&mut self, from: Pose2, to: Pose2) {
        self.motion.carry(from, to);
        self.begun.1 = to.transform(from.inverse_transform(self.begun.1));
    }

    /// What is known of it at `stamp`, for a robot at `robot` on the map.
    pub(crate) fn person(&self, stamp: f64, robot: Pose2, params: &TrackerParams) -> Person {
        let turn = rotation(-robot.heading);
        let Estimate { state, covariance } = self.estimate();
        let velocity = turn * state.fixed_view::<2, 1>(2, 0);
        Person {
            id: self.id,
            position: robot.inverse_transform(self.estimate().position()),
            velocity: Point2::new(velocity.x, velocity.y),
            position_covariance: turn * covariance.fixed_view::<2, 2>(0, 0) * turn.transpose(),
            velocity_covariance: turn * covariance.fixed_view::<2, 2>(2, 2) * turn.transpose(),
            age: stamp - self.seen,
            probability: 1.0 / (1.0 + exp(-self.evidence(stamp, params))),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_steady_walk_is_known_after_a_second_and_known_less_after_one_unseen() {
        let params = TrackerParams::default();
        let mut track = Track::new(1, Point2::new(0.0, 0.0), 0.05, 0.0, &params);
        for k in 1..=10 {
            let t = 0.1 * f64::from(k);
            track.predict(0.1, &params);
            track.update(Point2::new(0.8 * t, 0.2 * t), 0.05, t, &params);
        }
        let seen = track.person(1.0, Pose2::default(), &params);
        assert!(seen.velocity.distance(Point2::new(0.8, 0.2)) < 0.1, "{seen:?}");
        track.predict(1.0, &params);
        let hidden = track.person(2.0, Pose2::default(), &params);
        assert!(hidden.position.distance(Point2::new(1.6, 0.4)) < 0.15, "{hidden:?}");
        assert_eq!(hidden.age, 1.0);
        // More than the velocity it had makes of it, because it may have changed its way.
        let spread = |person: &Person| person.position_covariance[(0, 0)];
        assert!(spread(&hidden) > spread(&seen) + seen.velocity_covariance[(0, 0)], "{hidden:?}");
        assert!(hidden.velocity_covariance[(0, 0)] > 4.0 * seen.velocity_covariance[(0, 0)], "{hidden:?}");
    }

    #[test]
    fn who_is_carried_along_stays_where_the_robot_sees_it() {
        let params = TrackerParams::default();
        let mut track = Track::new(1, Point2::new(3.0, 1.0), 0.05, 0.0, &params);
        track.predict(0.1, &params);
        track.update(Point2::new(3.1, 1.0), 0.05, 0.1, &params);
        let (from, to) = (Pose2::new(1.0, 1.0, 0.2), Pose2::new(-4.0, 2.0, 1.5));
        let before = track.person(0.1, from, &params);
        track.carry(from, to);
        let after = track.person(0.1, to, &params);
        assert!(before.position.distance(after.position) < 1e-12);
        assert!(before.velocity.distance(after.velocity) < 1e-12);
        assert!((before.velocity_covariance - after.velocity_covariance).norm() < 1e-12);
    }

    #[test]
    fn what_stands_is_a_person_once_its_shape_says_so_and_what_walks_until_its_shape_denies_it() {
        let params = TrackerParams { confirm: 1, confirm_of: 1, ..TrackerParams::default() };
        let judged = |has_walked: bool, stamp: f64, roundness: f64| {
            let mut track = Track::new(1, Point2::default(), 0.05, 0.0, &params);
            track.has_walked = has_walked;
            track.take_shape(roundness);
            (track.is_person(stamp, &params), track.person(stamp, Pose2::default(), &params).probability)
        };
        for (has_walked, stamp, least) in [(true, 60.0, -3.0), (false, 1.0, -1.0), (false, 60.0, 3.0)] {
            assert_eq!(judged(has_walked, stamp, least), (false, 0.5));
            let (is_person, probability) = judged(has_walked, stamp, least + 0.01);
            assert!(is_person && probability > 0.5);
            // The odds are e to the evidence: here e to 1.
            let (is_person, probability) = judged(has_walked, stamp, least - 1.0);
            assert!(!is_person && (probability - 0.268_941).abs() < 1e-6, "{probability}");
        }
        // What has walked and shows no shape.
        assert!((judged(true, 60.0, 0.0).1 - 0.952_574).abs() < 1e-6);
    }

    #[test]
    fn three_of_five_scans_make_a_person() {
        let params = TrackerParams::default();
        let after = |pattern: &[bool]| {
            let mut track = Track::new(1, Point2::default(), 0.05, 0.0, &params);
            for &seen in pattern {
                if seen { track.update(Point2::default(), 0.05, 0.0, &params) } else { track.miss(&params) }
            }
            (track.confirmed, track.is_hopeless(&params))
        };
        assert_eq!(after(&[true, true]), (true, false));
        assert_eq!(after(&[false, true, false, true]), (true, false));
        assert_eq!(after(&[false, true]), (false, false));
        assert_eq!(after(&[false, false, true]), (false, false));
        assert_eq!(after(&[false, false, false]), (false, true));
    }
}
