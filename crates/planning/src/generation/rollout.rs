//! Timing a path: the unicycle is driven along it in closed loop, under its limits, and braked so that it
//! stands when the horizon ends (D14).

use crate::generation::path::Path;
use crate::geometry::{Direction, Facing, Pose2, Twist};
use crate::motion::{RobotModel, step_facing};
use crate::numerics::atan2;
use crate::states::States;

crate::parameters! {
    /// Parameters of the path-following law: pure pursuit (Coulter, 1992) with turning on the spot.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct RolloutParams {
        /// Longest step of integration, seconds: the driver's period, so that both move alike.
        pub substep: f64 [
            0.01, 1.0, "s", "shorter steps cost time and show nothing new;
            longer ones than the driver's move otherwise than it does"
        ] = 0.1,
        /// Distance of the pursued point at standstill, metres.
        pub lookahead: f64
            [0.05, 5.0, "m", "a nearer point makes the robot weave, a farther one cuts corners"] = 0.35,
        /// How much further it is per speed, seconds.
        pub lookahead_time: f64 [0.0, 5.0, "s", "a farther point cuts corners"] = 0.4,
        /// Beyond this bearing of the pursued point the robot turns on the spot, radians.
        pub turn_from: f64
            [0.01, 3.15, "rad", "no bearing is greater than half a turn; below, the robot never drives"] = 1.2,
        /// A turn that comes first ends at this bearing, radians.
        pub turn_until: f64
            [0.01, 3.15, "rad", "no bearing is greater than half a turn; below, a turn never ends"] = 0.25,
        /// Share of the greatest turn rate a path's bends may use; the rest is for corrections.
        pub turn_share: f64 [0.01, 1.0, "", "it is a share, and without any the robot never turns"] = 0.9,
    }
}

/// How a path is to be driven.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedProfile {
    /// Cruising speed as a fraction of the greatest.
    pub fraction: f64,
    /// Whether the robot first turns on the spot towards the path.
    pub turn_first: bool,
}

/// What a rollout starts from and how long it lasts.
#[derive(Debug, Clone, Copy)]
pub struct Departure<'a> {
    /// Where the robot is.
    pub pose: Pose2,
    /// How it moves.
    pub twist: Twist,
    /// What it can do.
    pub robot: &'a RobotModel,
    /// Number of states, at least 1.
    pub steps: usize,
    /// Seconds between states.
    pub dt: f64,
}

/// Drives along `path` from `from.pose` and adds `from.steps` states to `states`: where the robot is dt, 2 dt, ... after
/// the start. Speeds, turn rates and their changes obey the robot's limits at every substep, and the last state stands
/// still (if the limits allow it to stop at all within the horizon).
///
/// Gives the mean speed before the final braking ramp, m/s: the ramp is imposed on every candidate and says nothing about
/// whether this one gets anywhere.
pub fn rollout(
    path: &Path,
    profile: SpeedProfile,
    from: &Departure<'_>,
    params: &RolloutParams,
    states: &mut States,
) -> f64 {
    let pieces = (from.dt / params.substep - 1e-9).ceil().max(1.0) as usize;
    let h = from.dt / pieces as f64;
    let total = from.steps * pieces;
    let (mut at, mut twist) = (Facing::from(from.pose), from.twist);
    let mut state = Follower {
        path,
        params,
        robot: from.robot,
        profile,
        progress: 0,
        turning: profile.turn_first,
        turn_from: Direction::of(params.turn_from).cos,
        turn_until: Direction::of(params.turn_until).cos,
    };
    let (mut travelled, mut driven) = (0.0, 0.0);
    let mut ramp = false;
    for k in 1..=total {
        let left = (total - k) as f64 * h;
        let mut wanted = state.pursue(&at, twist, h);
        let v_cap = from.robot.a_max * left;
        ramp |= wanted.v > v_cap;
        if wanted.v > v_cap && wanted.v > 0.0 {
            // Slower on the same curve.
            wanted = Twist { v: v_cap, omega: wanted.omega * v_cap / wanted.v };
        }
        let omega_cap = from.robot.alpha_max * left;
        wanted.omega = wanted.omega.clamp(-omega_cap, omega_cap);
        twist = from.robot.limit(twist, wanted, h);
        at = step_facing(at, twist, h);
        if !ramp {
            travelled += twist.v * h;
            driven += h;
        }
        if k % pieces == 0 {
            states.push(at.pose, twist);
        }
    }
    if driven > 0.0 { travelled / driven } else { 0.0 }
}

struct Follower<'a> {
    path: &'a Path,
    params: &'a RolloutParams,
    robot: &'a RobotModel,
    profile: SpeedProfile,
    /// Index of the path's point the robot has come to.
    progress: usize,
    turning: bool,
    /// Cosines of the bearings of the same names.
    turn_from: f64,
    turn_until: f64,
}

impl Follower<'_> {
    /// The twist that leads towards the point ahead on the path.
    fn pursue(&mut self, from: &Facing, twist: Twist, h: f64) -> Twist {
        let position = from.pose.position();
        self.progress = self.path.advance(self.progress, position);
        let s = self.progress as f64 * Path::SPACING;
        let remaining = self.path.length() - s;
        let lookahead = self.params.lookahead + self.params.lookahead_time * twist.v;
        let (ahead, left) = from.direction.ahead_and_left(position, self.path.at(s + lookahead));
        let squared = ahead * ahead + left * left;
        let distance = squared.sqrt();
        // A bearing is greater than an angle where its cosine, ahead / distance, is less than the angle's.
        self.turning &= ahead < self.turn_until * distance;
        if self.turning || ahead < self.turn_from * distance {
            let bearing = atan2(left, ahead);
            let rate = (1.6 * self.robot.alpha_max * bearing.abs()).sqrt().min(self.robot.omega_max);
            let rate = if remaining > 0.0 { rate } else { 0.0 };
            return Twist { v: 0.0, omega: rate * bearing.signum() };
        }
        // Braking in steps of h: half a step's speed less keeps the stop before the path's end.
        let v_stop = (2.0 * self.robot.a_max * remaining.max(0.0)).sqrt() - 0.5 * self.robot.a_max * h;
        let curvature = if squared > 1e-6 { 2.0 * left / squared } else { 0.0 };
        let v_bend = self.params.turn_share * self.robot.omega_max / curvature.abs().max(1e-6);
        let v = (self.profile.fraction * self.robot.v_max).min(v_bend).min(v_stop).max(0.0);
        let reached = self.robot.limit_speed(twist.v, v, h);
        Twist { v, omega: curvature * reached }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Point2;
    use crate::random::{rng, uniform};

    /// The states, and the mean speed.
    fn driven(path: &Path, fraction: f64, turn_first: bool, from: &Departure<'_>) -> (States, f64) {
        let mut states = States::default();
        let profile = SpeedProfile { fraction, turn_first };
        let mean_speed = rollout(path, profile, from, &RolloutParams::default(), &mut states);
        (states, mean_speed)
    }

    fn departure(robot: &RobotModel, v: f64) -> Departure<'_> {
        Departure { pose: Pose2::default(), twist: Twist { v, omega: 0.0 }, robot, steps: 13, dt: 0.3 }
    }

    #[test]
    fn whatever_the_path_limits_hold_and_the_robot_stands_at_the_end() {
        let robot = RobotModel::default();
        let mut r = rng(11, 0);
        for _ in 0..500 {
            let points: Vec<Point2> = (0..6)
                .map(|_| Point2::new(4.0 * uniform(&mut r) - 1.0, 4.0 * uniform(&mut r) - 2.0))
                .collect();
            let path = Path::new(Point2::default(), points, 5.0);
            let (fraction, turn_first) = (0.2 + 0.8 * uniform(&mut r), uniform(&mut r) < 0.3);
            let from = departure(&robot, uniform(&mut r));
            let (out, _) = driven(&path, fraction, turn_first, &from);
            assert_eq!(out.len(), 13);
            let (mut pose, mut twist) = (from.pose, from.twist);
            for k in 0..13 {
                assert!(out.v[k] >= 0.0 && out.v[k] <= robot.v_max && out.omega[k].abs() <= robot.omega_max);
                assert!((out.v[k] - twist.v).abs() <= robot.a_max * 0.3 + 1e-9);
                assert!((out.omega[k] - twist.omega).abs() <= robot.alpha_max * 0.3 + 1e-9);
                let next = out.at(k);
                assert!(pose.position().distance(next.0.position()) <= robot.v_max * 0.3 + 1e-9);
                (pose, twist) = next;
            }
            assert!(twist.v.abs() < 1e-9 && twist.omega.abs() < 1e-9, "{twist:?}");
        }
    }

    #[test]
    fn a_straight_path_from_rest_goes_as_far_as_acceleration_and_braking_allow() {
        let robot = RobotModel::default();
        let path = Path::new(Point2::default(), [Point2::new(10.0, 0.0)], 10.0);
        let (out, mean_speed) = driven(&path, 1.0, false, &departure(&robot, 0.0));
        // 0.5 m/s2 up for 1.95 s and down for 1.95 s: 0.975 * 1.95 = 1.9 m
        assert!((out.x[12] - 1.9).abs() < 0.06, "{}", out.x[12]);
        // mean before the ramp is about half the peak
        assert!(mean_speed > 0.4 && mean_speed < 0.55);
    }

    #[test]
    fn a_path_that_ends_early_is_stopped_at() {
        let robot = RobotModel::default();
        let path = Path::new(Point2::default(), [Point2::new(1.0, 0.0)], 10.0);
        let (out, _) = driven(&path, 1.0, false, &departure(&robot, 0.5));
        assert!((out.x[12] - 1.0).abs() < 0.12, "{}", out.x[12]);
    }

    #[test]
    fn a_path_that_starts_behind_is_turned_to_on_the_spot() {
        let robot = RobotModel::default();
        let path = Path::new(Point2::default(), [Point2::new(-5.0, -0.5)], 10.0);
        let (out, _) = driven(&path, 1.0, true, &Departure { steps: 25, ..departure(&robot, 0.0) });
        assert!(out.x[3].abs() < 0.05 && out.heading[3].abs() > 0.3);
        assert!(out.x[24] < -1.0, "{}", out.x[24]);
    }
}
