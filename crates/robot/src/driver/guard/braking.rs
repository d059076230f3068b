//! Whether a speed is safe: the way that the robot goes until it stands, against what stands and what moves.

use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::step;

use super::approach::Movers;
use super::sweep::Sweep;

/// A step of the way is no longer than this, metres. A disc of 0.35 m then cuts no corner by more than 4 mm.
const STEP_LENGTH: f64 = 0.1;
/// A step of the way takes no longer than this, seconds.
const STEP_TIME: f64 = 0.1;
/// Below this speed a robot that turns counts as turning on the spot, m/s.
const SLOWEST_CURVE: f64 = 0.05;
/// No laser sees farther than this many steps.
const STEPS_MAX: usize = 1024;
/// What does not come nearer by this much does not come nearer, metres.
const NEARER: f64 = 1e-3;

/// The robot when a command reaches it, and how it brakes.
#[derive(Debug, Clone, Copy)]
pub(super) struct Approaching {
    /// Where it is then, in the odometry's frame; it faces where it drives.
    pub(super) pose: Pose2,
    /// How fast it is then in that direction, m/s.
    pub(super) speed: f64,
    /// When it is there, seconds after the scan.
    pub(super) after: f64,
    /// For how long it follows the command before it can be told to brake, seconds.
    pub(super) period: f64,
    /// Braking that it counts on, m/s2.
    pub(super) braking: f64,
    /// Radius of its circumscribed disc, metres.
    pub(super) radius: f64,
    /// Slower than this it may be met by what moves, m/s.
    pub(super) meeting_speed: f64,
}

/// Room kept between the robot's disc and anything the scan shows, metres, while it is hardly moving.
const MARGIN_AT_REST: f64 = 0.015;
/// How much more per speed, seconds: what the base misses a command by, and what the noise of a scan hides.
const MARGIN_PER_SPEED: f64 = 0.1;
/// The most of it, metres.
pub(super) const MARGIN: f64 = 0.05;
/// Up to this speed noise is averaged away, m/s. A faster robot keeps away from the nearest of noisy points.
const SMOOTHED_UP_TO: f64 = 0.5;

impl Approaching {
    /// Distance from its centre within which nothing may come while it is told to drive at `speed`, metres.
    fn reach(&self, speed: f64) -> f64 {
        self.radius + (MARGIN_AT_REST + MARGIN_PER_SPEED * speed.max(self.speed)).min(MARGIN)
    }

    /// The longest way until it stands if it is told to drive at `speed`, metres.
    pub(super) fn way(&self, speed: f64) -> f64 {
        let fastest = speed.max(self.speed);
        fastest * self.period + fastest * fastest / (2.0 * self.braking)
    }
}

/// What stands around the robot: points within its reach, one array for each quantity.
#[derive(Debug, Default)]
pub(super) struct Standing {
    x: Vec<f64>,
    y: Vec<f64>,
    /// Square of the distance that the robot may come to at most: what is within reach already may be left, not
    /// approached.
    nearest: Vec<f64>,
}

impl Standing {
    /// Takes the points that were seen and that the robot can reach until it stands, if it is told to drive at `told`
    /// m/s.
    pub(super) fn gather(&mut self, seen: &[&Sweep], robot: &Approaching, told: f64) {
        let way = robot.way(told);
        let is_slow = told.max(robot.speed) <= SMOOTHED_UP_TO;
        self.x.clear();
        self.y.clear();
        self.nearest.clear();
        let farthest = (robot.radius + MARGIN + way) * (robot.radius + MARGIN + way);
        for (x, y) in seen.iter().flat_map(|sweep| sweep.points(is_slow)) {
            let dx = x - robot.pose.x;
            let dy = y - robot.pose.y;
            let squared = dx * dx + dy * dy;
            if squared < farthest {
                self.x.push(*x);
                self.y.push(*y);
                let nearest = (squared.sqrt() - NEARER).max(0.0);
                self.nearest.push(nearest * nearest);
            }
        }
    }

    /// Whether a point comes within `reach` metres of a robot at `at`.
    fn is_hit(&self, at: Point2, reach: f64) -> bool {
        let reach = reach * reach;
        let points = self.x.iter().zip(&self.y).zip(&self.nearest);
        // Without an early end the compiler compares several at once.
        points.fold(false, |hit, ((x, y), nearest)| {
            let dx = x - at.x;
            let dy = y - at.y;
            let squared = dx * dx + dy * dy;
            hit | (squared < reach && squared < *nearest)
        })
    }
}

/// Whether something that moves meets the robot at `at`, `time` seconds after the scan, that would not come as near if
/// the robot stood.
fn is_met(movers: &Movers, robot: &Approaching, at: Point2, time: f64) -> bool {
    let reach = (robot.radius + MARGIN) * (robot.radius + MARGIN);
    (0..movers.x.len()).any(|i| {
        let there = Point2::new(movers.x[i] + movers.vx[i] * time, movers.y[i] + movers.vy[i] * time);
        let squared = there.distance_squared(at);
        squared < reach && squared.sqrt() < there.distance(robot.pose.position()) - NEARER
    })
}

/// Whether a robot that is told to drive with `told` until the next command, and brakes then, touches nothing that
/// stands, and is slow when something that moves meets it. It stays on the curve that it was told, as braking does.
pub(super) fn is_safe(robot: &Approaching, told: Twist, standing: &Standing, movers: &Movers) -> bool {
    let mut pose = robot.pose;
    let mut speed = told.v.max(robot.speed);
    let mut time = 0.0;
    let reach = robot.reach(told.v);
    let curvature = told.omega / told.v.max(SLOWEST_CURVE);
    for _ in 0..STEPS_MAX {
        if speed <= 0.0 {
            return true;
        }
        let held = (robot.period - time).max(0.0);
        let mut span = STEP_TIME.min(STEP_LENGTH / speed);
        let next = if held > 1e-9 {
            span = span.min(held);
            // While the command holds, a base that has to slow down first does so at its own pace.
            if time + span >= robot.period - 1e-9 { told.v } else { speed }
        } else {
            span = span.min(speed / robot.braking);
            speed - robot.braking * span
        };
        let mean = if held > 1e-9 { speed } else { 0.5 * (speed + next) };
        pose = step(pose, Twist { v: mean, omega: mean * curvature }, span);
        time += span;
        speed = if next < 1e-9 { 0.0 } else { next };
        let at = pose.position();
        if standing.is_hit(at, reach) {
            return false;
        }
        if speed > robot.meeting_speed && is_met(movers, robot, at, robot.after + time) {
            return false;
        }
    }
    false
}
