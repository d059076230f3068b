//! Driving along a timed trajectory: the tracking law of Kanayama et al. (1990) for a unicycle.

use serde::{Deserialize, Serialize};

use crate::geometry::{Pose2, Twist, wrap_angle};
use crate::motion::RobotModel;
use crate::numerics::sin_cos;

/// A trajectory to be tracked: state k (from 0) is due `(k + 1) * dt` after its stamp, as in a candidate.
#[derive(Debug, Clone, Copy)]
pub struct Reference<'a> {
    /// Pose at the stamp, map frame.
    pub start: Pose2,
    /// Twist at the stamp.
    pub start_twist: Twist,
    /// Seconds between states, positive.
    pub dt: f64,
    /// Metres; all arrays have the same length.
    pub x: &'a [f64],
    /// Metres.
    pub y: &'a [f64],
    /// Radians.
    pub heading: &'a [f64],
    /// m/s.
    pub v: &'a [f64],
    /// rad/s.
    pub omega: &'a [f64],
}

impl Reference<'_> {
    /// Seconds from the stamp to the last state.
    pub fn duration(&self) -> f64 {
        self.x.len() as f64 * self.dt
    }

    /// Where the trajectory is `t` seconds after its stamp: linear between states, the last one at rest
    /// from the end on.
    pub fn at(&self, t: f64) -> (Pose2, Twist) {
        let states = self.x.len();
        let s = t.max(0.0) / self.dt;
        if s >= states as f64 {
            let last = states.checked_sub(1).map_or(self.start, |k| self.state(k).0);
            return (last, Twist::default());
        }
        let next = s as usize;
        let part = s - next as f64;
        let (from, from_twist) =
            if next == 0 { (self.start, self.start_twist) } else { self.state(next - 1) };
        let (to, to_twist) = self.state(next);
        let blend = |a: f64, b: f64| a + part * (b - a);
        let heading = wrap_angle(from.heading + part * wrap_angle(to.heading - from.heading));
        let pose = Pose2::new(blend(from.x, to.x), blend(from.y, to.y), heading);
        let twist =
            Twist { v: blend(from_twist.v, to_twist.v), omega: blend(from_twist.omega, to_twist.omega) };
        (pose, twist)
    }

    fn state(&self, k: usize) -> (Pose2, Twist) {
        (Pose2::new(self.x[k], self.y[k], self.heading[k]), Twist { v: self.v[k], omega: self.omega[k] })
    }
}

/// Gains of the tracking law. At speed v the lateral error swings with v * sqrt(across) and damping
/// heading / (2 sqrt(across)); the defaults give a well damped 1.4 rad/s at 1 m/s, which turn rates and
/// their changes limited to about 1 can follow at 10 Hz.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct TrackingParams {
    /// Speed per error along the trajectory, 1/s.
    pub along: f64,
    /// Turn rate per lateral error and speed, 1/m2.
    pub across: f64,
    /// Turn rate per heading error and speed, 1/m.
    pub heading: f64,
    /// Speed below which the heading error counts as at this speed, m/s: turning on the spot.
    pub least_speed: f64,
    /// Most that the law adds to the reference's speed to catch up, m/s.
    pub catch_up: f64,
}

impl Default for TrackingParams {
    fn default() -> Self {
        Self { along: 1.0, across: 2.0, heading: 2.6, least_speed: 0.4, catch_up: 0.2 }
    }
}

/// The twist to command for the next `period` seconds, within the robot's limits, `t` seconds after
/// the reference's stamp, when the robot is at `pose` moving with `twist`. Zero (reached by
/// braking) once the reference has ended.
pub fn track(
    reference: &Reference<'_>,
    t: f64,
    pose: Pose2,
    twist: Twist,
    robot: &RobotModel,
    period: f64,
    params: &TrackingParams,
) -> Twist {
    if t >= reference.duration() {
        return robot.limit(twist, Twist::default(), period);
    }
    let (wanted_pose, _) = reference.at(t);
    // The command holds until the end of the period: that is the twist it should reach.
    let (_, feed) = reference.at(t + period);
    let error = pose.relative(wanted_pose);
    let (sin, cos) = sin_cos(error.heading);
    let v = feed.v * cos + (params.along * error.x).min(params.catch_up);
    let omega =
        feed.omega + feed.v * params.across * error.y + feed.v.max(params.least_speed) * params.heading * sin;
    robot.limit(twist, Twist { v, omega }, period)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::motion::step;

    struct Trajectory {
        x: Vec<f64>,
        y: Vec<f64>,
        heading: Vec<f64>,
        v: Vec<f64>,
        omega: Vec<f64>,
    }

    /// States every 0.3 s of a robot that is asked for `wanted(t)` from rest at the origin.
    fn drive(robot: &RobotModel, states: usize, wanted: impl Fn(f64) -> Twist) -> Trajectory {
        let mut t = Trajectory { x: vec![], y: vec![], heading: vec![], v: vec![], omega: vec![] };
        let (mut pose, mut twist) = (Pose2::default(), Twist::default());
        for k in 0..states * 3 {
            twist = robot.limit(twist, wanted(0.1 * k as f64), 0.1);
            pose = step(pose, twist, 0.1);
            if k % 3 == 2 {
                t.x.push(pose.x);
                t.y.push(pose.y);
                t.heading.push(pose.heading);
                t.v.push(twist.v);
                t.omega.push(twist.omega);
            }
        }
        t
    }

    fn reference(t: &Trajectory) -> Reference<'_> {
        Reference {
            start: Pose2::default(),
            start_twist: Twist::default(),
            dt: 0.3,
            x: &t.x,
            y: &t.y,
            heading: &t.heading,
            v: &t.v,
            omega: &t.omega,
        }
    }

    /// Distance and heading error at the end when tracking from `pose`.
    fn error_after(t: &Trajectory, mut pose: Pose2) -> (f64, f64) {
        let (robot, r) = (RobotModel::default(), reference(t));
        let mut twist = Twist::default();
        let ticks = (r.duration() / 0.1).round() as usize;
        for k in 0..ticks {
            twist = track(&r, 0.1 * k as f64, pose, twist, &robot, 0.1, &TrackingParams::default());
            pose = step(pose, twist, 0.1);
        }
        let (end, _) = r.at(r.duration());
        (pose.position().distance(end.position()), wrap_angle(pose.heading - end.heading).abs())
    }

    #[test]
    fn from_the_start_pose_the_trajectory_is_driven_to_centimetres() {
        let robot = RobotModel::default();
        let slalom = drive(&robot, 13, |t| Twist {
            v: if t < 2.4 { 0.8 } else { 0.0 },
            omega: if t < 1.5 { 0.5 } else { -0.4 },
        });
        let (distance, heading) = error_after(&slalom, Pose2::default());
        assert!(distance < 0.05 && heading < 0.05, "{distance} {heading}");
    }

    #[test]
    fn an_initial_error_dies_out() {
        let robot = RobotModel::default();
        let line = drive(&robot, 20, |_| Twist { v: 0.8, omega: 0.0 });
        for start in [Pose2::new(0.0, 0.2, 0.0), Pose2::new(-0.1, -0.1, 0.3), Pose2::new(0.1, 0.0, -0.3)] {
            let (distance, heading) = error_after(&line, start);
            assert!(distance < 0.04 && heading < 0.05, "{start:?}: {distance} {heading}");
        }
    }

    #[test]
    fn turning_on_the_spot_is_tracked_too() {
        let robot = RobotModel::default();
        let turn = drive(&robot, 13, |t| Twist { v: 0.0, omega: if t < 1.5 { 0.8 } else { 0.0 } });
        let (distance, heading) = error_after(&turn, Pose2::new(0.0, 0.0, -0.2));
        assert!(distance < 0.05 && heading < 0.06, "{distance} {heading}");
    }

    #[test]
    fn commands_obey_the_limits_and_end_in_standing_still() {
        let robot = RobotModel::default();
        let line = drive(&robot, 10, |_| Twist { v: 1.0, omega: 0.3 });
        let r = reference(&line);
        let (mut pose, mut twist) = (Pose2::new(-1.0, 2.0, 2.0), Twist::default());
        for k in 0..80 {
            let next = track(&r, 0.1 * f64::from(k), pose, twist, &robot, 0.1, &TrackingParams::default());
            assert!(next.v >= 0.0 && next.v <= robot.v_max && next.omega.abs() <= robot.omega_max);
            assert!((next.v - twist.v).abs() <= robot.a_max * 0.1 + 1e-12);
            assert!((next.omega - twist.omega).abs() <= robot.alpha_max * 0.1 + 1e-12);
            twist = next;
            pose = step(pose, twist, 0.1);
        }
        assert_eq!(twist, Twist::default());
    }
}
