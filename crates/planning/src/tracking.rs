//! Driving along a timed trajectory: the tracking law of Kanayama et al. (1990) for a unicycle.

use crate::geometry::{Pose2, Twist};
use crate::motion::RobotModel;
use crate::numerics::sin_cos;
use crate::trajectory::Trajectory;

/// Speed per error along the trajectory, 1/s.
const ALONG: f64 = 1.0;
/// Turn rate per lateral error and speed, 1/m2. At speed v the lateral error swings with v * sqrt(across) and damping
/// heading / (2 sqrt(across)): with these gains a well damped 1.4 rad/s at 1 m/s, which turn rates and their changes
/// limited to about 1 can follow at 10 Hz.
const ACROSS: f64 = 2.0;
/// Turn rate per heading error and speed, 1/m.
const HEADING: f64 = 2.6;
/// Speed below which the heading error counts as at this speed, m/s: turning on the spot.
const LEAST_SPEED: f64 = 0.4;
/// Most that the law adds to the reference's speed to catch up, m/s.
const CATCH_UP: f64 = 0.2;

/// The twist to command for the next `period` seconds, within the robot's limits, `t` seconds after
/// the stamp of `reference`, when the robot is at `pose` moving with `twist`. Zero (reached by
/// braking) once the reference has ended.
pub fn track(
    reference: &Trajectory,
    t: f64,
    pose: Pose2,
    twist: Twist,
    robot: &RobotModel,
    period: f64,
) -> Twist {
    if t >= reference.duration() {
        return robot.limit(twist, Twist::default(), period);
    }
    let (wanted_pose, _) = reference.at(t);
    // The command holds until the end of the period: that is the twist it should reach.
    let (_, feed) = reference.at(t + period);
    let error = pose.relative(wanted_pose);
    let (sin, cos) = sin_cos(error.heading);
    // Backwards only where the reference goes so, and forwards only there: a robot that has gone too far waits.
    let v = if feed.v < 0.0 {
        (feed.v * cos + (ALONG * error.x).max(-CATCH_UP)).min(0.0)
    } else {
        (feed.v * cos + (ALONG * error.x).min(CATCH_UP)).clamp(0.0, f64::INFINITY)
    };
    let omega = feed.omega + feed.v * ACROSS * error.y + feed.v.abs().max(LEAST_SPEED) * HEADING * sin;
    robot.limit(twist, Twist { v, omega }, period)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::wrap_angle;
    use crate::motion::step;
    use crate::states::States;

    /// States every 0.3 s of a robot that is asked for `wanted(t)` from rest at the origin.
    fn drive(robot: &RobotModel, states: usize, wanted: impl Fn(f64) -> Twist) -> Trajectory {
        let mut recorded = States::default();
        let mut pose = Pose2::default();
        let mut twist = Twist::default();
        for k in 0..states * 3 {
            twist = robot.limit(twist, wanted(0.1 * k as f64), 0.1);
            pose = step(pose, twist, 0.1);
            if k % 3 == 2 {
                recorded.push(pose, twist);
            }
        }
        Trajectory::new(Default::default(), 0.3, recorded).unwrap()
    }

    /// Distance and heading error at the end when tracking from `pose`.
    fn error_after(r: &Trajectory, pose: Pose2) -> (f64, f64) {
        error_of(&RobotModel::default(), r, pose)
    }

    fn error_of(robot: &RobotModel, r: &Trajectory, mut pose: Pose2) -> (f64, f64) {
        let mut twist = Twist::default();
        let ticks = (r.duration() / 0.1).round() as usize;
        for k in 0..ticks {
            twist = track(r, 0.1 * k as f64, pose, twist, robot, 0.1);
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
    fn backwards_is_driven_as_exactly_and_only_where_the_reference_goes_so() {
        let robot = RobotModel { v_reverse: 0.3, ..RobotModel::default() };
        // Backwards is slow, and an error dies out with the way: it needs two metres, which take 12 s.
        let back = drive(&robot, 40, |t| Twist { v: if t < 11.0 { -0.2 } else { 0.0 }, omega: 0.1 });
        for start in [Pose2::default(), Pose2::new(0.05, 0.05, -0.1), Pose2::new(-0.05, 0.0, 0.1)] {
            let (distance, heading) = error_of(&robot, &back, start);
            assert!(distance < 0.05 && heading < 0.06, "{start:?}: {distance} {heading}");
        }
        for (sign, beyond) in [(1.0, 1.0), (-1.0, -2.0)] {
            let line = drive(&robot, 5, |_| Twist { v: 0.3 * sign, omega: 0.0 });
            for tenth in 0..20 {
                let too_far = Pose2::new(beyond, 0.0, 0.0);
                let told = track(&line, 0.1 * f64::from(tenth), too_far, Twist::default(), &robot, 0.1);
                assert_eq!(told.v, 0.0, "{beyond} m after {tenth} tenths of a second");
            }
        }
    }

    #[test]
    fn commands_obey_the_limits_and_end_in_standing_still() {
        let robot = RobotModel::default();
        let line = drive(&robot, 10, |_| Twist { v: 1.0, omega: 0.3 });
        let mut pose = Pose2::new(-1.0, 2.0, 2.0);
        let mut twist = Twist::default();
        for k in 0..80 {
            let next = track(&line, 0.1 * f64::from(k), pose, twist, &robot, 0.1);
            assert!(next.v >= 0.0 && next.v <= robot.v_max && next.omega.abs() <= robot.omega_max);
            assert!((next.v - twist.v).abs() <= robot.a_max * 0.1 + 1e-12);
            assert!((next.omega - twist.omega).abs() <= robot.alpha_max * 0.1 + 1e-12);
            twist = next;
            pose = step(pose, twist, 0.1);
        }
        assert_eq!(twist, Twist::default());
    }
}
