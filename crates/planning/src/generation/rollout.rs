//! Timing a path: the unicycle is driven along it in closed loop, under its limits, and braked so that it
//! stands when the horizon ends (D14).

use crate::generation::path::Path;
use crate::geometry::{Direction, Facing, Point2, Pose2, Twist, wrap_angle};
use crate::motion::RobotModel;
use crate::numerics::{SMALL_ANGLE, atan2, sin_cos, sinc_cos};
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

/// A path and how it is to be driven.
#[derive(Debug, Clone, Copy)]
pub struct Drive<'a> {
    /// Where along.
    pub path: &'a Path,
    /// How fast.
    pub profile: SpeedProfile,
}

/// Rollouts that are driven side by side: enough for vector registers and for independent work.
const LANES: usize = 8;

/// One number of each lane.
type Lanes = [f64; LANES];

/// Drives along every path from `from.pose` and adds `from.steps` states of each to `states`: where the robot is dt, 2 dt,
/// ... after the start. Speeds, turn rates and their changes obey the robot's limits at every substep, and the last state
/// stands still (if the limits allow it to stop at all within the horizon).
///
/// Gives the mean speed of each before its final braking ramp, m/s: the ramp is imposed on every candidate and says
/// nothing about whether this one gets anywhere.
pub fn rollouts(
    drives: &[Drive<'_>],
    from: &Departure<'_>,
    params: &RolloutParams,
    states: &mut States,
) -> Vec<f64> {
    let pieces = (from.dt / params.substep - 1e-9).ceil().max(1.0) as usize;
    let law = Law {
        robot: from.robot,
        params,
        h: from.dt / pieces as f64,
        turn_from: Direction::of(params.turn_from).cos,
        turn_until: Direction::of(params.turn_until).cos,
    };
    let mut mean_speeds = Vec::with_capacity(drives.len());
    for chunk in drives.chunks(LANES) {
        // The last group is filled up with copies of the last drive.
        let drives: [Drive<'_>; LANES] = std::array::from_fn(|lane| chunk[lane.min(chunk.len() - 1)]);
        let mut robots = Robots::new(&drives, from);
        let first = states.len();
        states.lengthen(chunk.len() * from.steps);
        for k in 1..=from.steps * pieces {
            let left = (from.steps * pieces - k) as f64 * law.h;
            robots.advance(&drives, &law, left);
            if k % pieces == 0 {
                for lane in 0..chunk.len() {
                    let (pose, twist) = robots.state(lane);
                    states.set(first + lane * from.steps + k / pieces - 1, pose, twist);
                }
            }
        }
        mean_speeds.extend((0..chunk.len()).map(|lane| robots.mean_speed(lane)));
    }
    mean_speeds
}

/// What is the same for all lanes and times.
struct Law<'a> {
    robot: &'a RobotModel,
    params: &'a RolloutParams,
    /// Seconds per substep.
    h: f64,
    /// Cosines of the bearings of the same names.
    turn_from: f64,
    turn_until: f64,
}

/// The robot in every lane.
struct Robots {
    x: Lanes,
    y: Lanes,
    heading: Lanes,
    cos: Lanes,
    sin: Lanes,
    v: Lanes,
    omega: Lanes,
    /// Share of the greatest speed.
    fraction: Lanes,
    /// Index of the path's point the robot has come to.
    progress: [usize; LANES],
    /// Whether it is turning on the spot before it drives.
    turning: [bool; LANES],
    /// Whether it is on the final braking ramp.
    ramp: [bool; LANES],
    /// Metres and seconds driven before that.
    travelled: Lanes,
    driven: Lanes,
}

impl Robots {
    fn new(drives: &[Drive<'_>; LANES], from: &Departure<'_>) -> Self {
        let Facing { pose, direction } = from.pose.into();
        Self {
            x: [pose.x; LANES],
            y: [pose.y; LANES],
            heading: [pose.heading; LANES],
            cos: [direction.cos; LANES],
            sin: [direction.sin; LANES],
            v: [from.twist.v; LANES],
            omega: [from.twist.omega; LANES],
            fraction: drives.map(|drive| drive.profile.fraction),
            progress: [0; LANES],
            turning: drives.map(|drive| drive.profile.turn_first),
            ramp: [false; LANES],
            travelled: [0.0; LANES],
            driven: [0.0; LANES],
        }
    }

    fn state(&self, lane: usize) -> (Pose2, Twist) {
        let pose = Pose2::new(self.x[lane], self.y[lane], wrap_angle(self.heading[lane]));
        (pose, Twist { v: self.v[lane], omega: self.omega[lane] })
    }

    fn mean_speed(&self, lane: usize) -> f64 {
        if self.driven[lane] > 0.0 { self.travelled[lane] / self.driven[lane] } else { 0.0 }
    }

    /// One substep, after which `left` seconds remain.
    fn advance(&mut self, drives: &[Drive<'_>; LANES], law: &Law<'_>, left: f64) {
        let [mut target_x, mut target_y, mut remaining] = [[0.0; LANES]; 3];
        for (lane, Drive { path, .. }) in drives.iter().enumerate() {
            let position = Point2::new(self.x[lane], self.y[lane]);
            self.progress[lane] = path.advance(self.progress[lane], position);
            let s = self.progress[lane] as f64 * Path::SPACING;
            remaining[lane] = path.length() - s;
            let target = path.at(s + law.params.lookahead + law.params.lookahead_time * self.v[lane]);
            (target_x[lane], target_y[lane]) = (target.x, target.y);
        }
        let (mut v, mut omega) = self.pursue(law, &target_x, &target_y, &remaining);
        self.brake_and_limit(law, left, &mut v, &mut omega);
        self.step(law.h);
    }

    /// The twists that lead towards the points ahead on the paths.
    #[inline(always)]
    fn pursue(&mut self, law: &Law<'_>, x: &Lanes, y: &Lanes, remaining: &Lanes) -> (Lanes, Lanes) {
        let RobotModel { v_max, a_max, omega_max, alpha_max, .. } = *law.robot;
        let [mut ahead, mut left, mut v, mut omega] = [[0.0; LANES]; 4];
        let mut on_the_spot = [false; LANES];
        for i in 0..LANES {
            let (dx, dy) = (x[i] - self.x[i], y[i] - self.y[i]);
            (ahead[i], left[i]) = (self.cos[i] * dx + self.sin[i] * dy, self.cos[i] * dy - self.sin[i] * dx);
            let squared = ahead[i] * ahead[i] + left[i] * left[i];
            let distance = squared.sqrt();
            // A bearing is greater than an angle where its cosine, ahead / distance, is less than the angle's.
            self.turning[i] &= ahead[i] < law.turn_until * distance;
            on_the_spot[i] = self.turning[i] | (ahead[i] < law.turn_from * distance);
            // Braking in steps of h: half a step's speed less keeps the stop before the path's end.
            let v_stop = (2.0 * a_max * at_least(remaining[i], 0.0)).sqrt() - 0.5 * a_max * law.h;
            let curvature = 2.0 * left[i] / at_least(squared, 1e-6);
            let v_bend = law.params.turn_share * omega_max / at_least(curvature.abs(), 1e-6);
            v[i] = at_least(at_most(at_most(self.fraction[i] * v_max, v_bend), v_stop), 0.0);
            omega[i] = curvature * law.limit_speed(self.v[i], v[i]);
        }
        for i in (0..LANES).filter(|&i| on_the_spot[i]) {
            let bearing = atan2(left[i], ahead[i]);
            let rate = (1.6 * alpha_max * bearing.abs()).sqrt().min(omega_max);
            let rate = if remaining[i] > 0.0 { rate } else { 0.0 };
            (v[i], omega[i]) = (0.0, rate * bearing.signum());
        }
        (v, omega)
    }

    /// Takes over wanted twists as far as the limits let the robot stand when `left` seconds are over.
    #[inline(always)]
    fn brake_and_limit(&mut self, law: &Law<'_>, left: f64, v: &mut Lanes, omega: &mut Lanes) {
        let RobotModel { a_max, omega_max, alpha_max, .. } = *law.robot;
        let (v_cap, omega_cap) = (a_max * left, alpha_max * left);
        let change = alpha_max * law.h;
        for i in 0..LANES {
            let is_fast = v[i] > v_cap;
            self.ramp[i] |= is_fast;
            // Slower on the same curve.
            let share = if is_fast { v_cap / v[i] } else { 1.0 };
            let wanted = at_least(at_most(omega[i] * share, omega_cap), -omega_cap);
            let omega = at_least(at_most(wanted, self.omega[i] + change), self.omega[i] - change);
            self.omega[i] = at_least(at_most(omega, omega_max), -omega_max);
            self.v[i] = law.limit_speed(self.v[i], at_most(v[i], v_cap));
            let counts = if self.ramp[i] { 0.0 } else { law.h };
            self.travelled[i] += self.v[i] * counts;
            self.driven[i] += counts;
        }
    }

    /// As [`crate::motion::step_facing`] for small angles; headings are not wrapped.
    #[inline(always)]
    fn step(&mut self, h: f64) {
        let half: Lanes = std::array::from_fn(|i| 0.5 * h * self.omega[i]);
        let is_small = half.iter().all(|half| half.abs() <= SMALL_ANGLE);
        let turns: [(f64, f64); LANES] = if is_small {
            half.map(sinc_cos)
        } else {
            half.map(|half| {
                let (sin, cos) = sin_cos(half);
                (if half == 0.0 { 1.0 } else { sin / half }, cos)
            })
        };
        for i in 0..LANES {
            let (sinc, cos) = turns[i];
            let (sin, chord) = (half[i] * sinc, self.v[i] * h * sinc);
            let middle = (self.cos[i] * cos - self.sin[i] * sin, self.sin[i] * cos + self.cos[i] * sin);
            self.x[i] += chord * middle.0;
            self.y[i] += chord * middle.1;
            self.cos[i] = middle.0 * cos - middle.1 * sin;
            self.sin[i] = middle.1 * cos + middle.0 * sin;
            self.heading[i] += 2.0 * half[i];
        }
    }
}

impl Law<'_> {
    /// As [`RobotModel::limit_speed`].
    #[inline(always)]
    fn limit_speed(&self, current: f64, wanted: f64) -> f64 {
        let change = self.robot.a_max * self.h;
        let v = at_least(at_most(wanted, current + change), current - change);
        at_least(at_most(v, self.robot.v_max), 0.0)
    }
}

/// The lesser of two numbers, in one instruction: what it gives for NaN does not matter.
#[inline(always)]
fn at_most(x: f64, most: f64) -> f64 {
    if x < most { x } else { most }
}

/// The greater of two numbers.
#[inline(always)]
fn at_least(x: f64, least: f64) -> f64 {
    if x > least { x } else { least }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{rng, uniform};

    /// The states, and the mean speed.
    fn driven(path: &Path, fraction: f64, turn_first: bool, from: &Departure<'_>) -> (States, f64) {
        let mut states = States::default();
        let drive = Drive { path, profile: SpeedProfile { fraction, turn_first } };
        let mean_speeds = rollouts(&[drive], from, &RolloutParams::default(), &mut states);
        (states, mean_speeds[0])
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
