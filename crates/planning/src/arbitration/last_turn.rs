//! The last turn on the spot, to the heading that is asked for at the goal.

use crate::geometry::{Twist, wrap_angle};
use crate::motion::{RobotModel, step};
use crate::scene::Scene;
use crate::states::States;
use crate::trajectory::Trajectory;

/// The robot has the heading that is asked for if it misses it by no more, radians: half of what people see at a
/// glance, and more than a localiser errs by.
const WITHIN: f64 = 0.09;
/// A robot that turns more slowly stands, rad/s.
const STANDS: f64 = 0.1;
/// After so long at its goal a robot that has not come to the heading stays as it is, seconds.
const PATIENCE: f64 = 20.0;
/// Steps of integration for each state.
const SUBSTEPS: usize = 3;
/// Share of the greatest acceleration that the turn counts on to end in time.
const BRAKES: f64 = 0.8;

/// The turn on the spot to `heading`, `steps` states of `dt` seconds; none if the robot has that heading, or has tried
/// for long enough.
pub(super) fn turn(
    scene: &Scene,
    robot: &RobotModel,
    heading: f64,
    steps: usize,
    dt: f64,
) -> Option<Trajectory> {
    let (mut pose, mut twist) = scene.belief.motion();
    let is_there = wrap_angle(heading - pose.heading).abs() <= WITHIN && twist.omega.abs() <= STANDS;
    if is_there || scene.in_place >= PATIENCE {
        return None;
    }
    let seconds = dt / SUBSTEPS as f64;
    let mut states = States::default();
    for _ in 0..steps {
        for _ in 0..SUBSTEPS {
            let off = wrap_angle(heading - pose.heading);
            // So fast that it can still stop where it has to, and no faster than one substep asks for.
            let rate = (2.0 * BRAKES * robot.alpha_max * off.abs()).sqrt().min(off.abs() / seconds);
            let wanted = Twist { v: 0.0, omega: rate.min(robot.omega_max).copysign(off) };
            twist = robot.limit(twist, wanted, seconds);
            pose = step(pose, twist, seconds);
        }
        states.push(pose, twist);
    }
    Trajectory::new(scene.belief.motion(), dt, states).ok()
}
