//! What the laser has seen around the robot in the last second. The robot drives no faster than lets it stop there.

use std::f64::consts::{FRAC_PI_4, PI, TAU};

use curionav_mission::convert;
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::{RobotModel, step};
use curionav_schemas::Scan;

/// Directions that are told apart. Each holds a beam of every scanner whose beams are at most as far apart as beams
/// that count as neighbours.
const SECTORS: usize = 36;
/// What was seen longer ago than this counts as not seen, seconds.
const REMEMBERED: f64 = 1.0;
/// The way is looked along in steps of this many metres.
const STRIDE: f64 = 0.1;
/// What lies so near to the robot's disc is the robot's own, metres.
const MARGIN: f64 = 0.05;
/// The points of the robot that go first, as bearings from its centre, radians.
const LEADING: [f64; 3] = [-FRAC_PI_4, 0.0, FRAC_PI_4];

/// When each direction was seen last.
///
/// Directions are those of odometry, so they stay when the robot turns. What it has driven since is left out: in a
/// second that is little beside how far a laser sees, and what is near the guard judges by the newest scan.
#[derive(Debug, Clone)]
pub struct SeenWay {
    /// Stamp of the newest beam in each, seconds of the robot's clock.
    last: [f64; SECTORS],
    /// How far the newest scan reaches from the robot's centre, metres.
    reach: f64,
}

impl Default for SeenWay {
    fn default() -> Self {
        Self { last: [f64::NEG_INFINITY; SECTORS], reach: 0.0 }
    }
}

impl SeenWay {
    /// All directions seen, for ever and however far: what does not judge the way.
    pub const ALL: Self = Self { last: [f64::INFINITY; SECTORS], reach: f64::INFINITY };

    /// Takes in a scan, taken while odometry had this heading.
    pub fn see(&mut self, scan: &Scan, odometry_heading: f64) {
        self.reach = scan.range_max - scan.laser.x.hypot(scan.laser.y);
        let first = odometry_heading + scan.laser.heading + scan.angle_min;
        for (i, _) in convert::beams(scan).enumerate().filter(|(_, beam)| beam.speaks()) {
            let at = sector(first + scan.angle_increment * i as f64);
            self.last[at] = scan.stamp;
        }
    }

    /// The command, or a slower one if the robot could not stop within what was seen. It looks along the arc of the
    /// command that is driven until the next one, `period` seconds later, and while braking fully. The turn rate
    /// stays: turning shows what is not seen. A robot that drives backwards faces the other way, and looks along a
    /// stride at least: however slow it is, what is close behind it has to be seen.
    pub fn slowed(
        &self,
        command: Twist,
        odometry: Pose2,
        now: f64,
        robot: &RobotModel,
        period: f64,
    ) -> Twist {
        if command.v == 0.0 {
            return command;
        }
        let is_back = command.v < 0.0;
        let speed = command.v.abs();
        let facing = if is_back { odometry.heading + PI } else { odometry.heading };
        let to_stop = speed * period + robot.stopping_distance(speed);
        let looked_at = if is_back { to_stop.max(STRIDE) } else { to_stop };
        let ahead = Twist { v: speed, ..command };
        let free = self.free_way(ahead, looked_at, facing, now, robot.radius());
        if free >= looked_at {
            return command;
        }
        // The speed from which `free` is what a period and the brakes take.
        let a = robot.a_max;
        let fastest = (a * ((period * period + 2.0 * free / a).sqrt() - period)).clamp(0.0, speed);
        Twist { v: if is_back { 0.0 - fastest } else { fastest }, omega: command.omega }
    }

    /// How far along its arc the robot stays within what was seen, up to `most` metres.
    fn free_way(&self, command: Twist, most: f64, heading: f64, now: f64, radius: f64) -> f64 {
        let strides = (most / STRIDE).ceil() as usize;
        for k in 1..=strides {
            let way = most.min(STRIDE * k as f64);
            let pose = step(Pose2::default(), command, way / command.v);
            let leading = LEADING.map(|bearing| at_bearing(pose, bearing, radius));
            if leading.into_iter().any(|point| !self.is_seen(point, heading, now, radius)) {
                return STRIDE * (k - 1) as f64;
            }
        }
        most
    }

    /// Whether a point of the robot's frame is the robot's own or was seen.
    fn is_seen(&self, point: Point2, heading: f64, now: f64, radius: f64) -> bool {
        let distance = point.distance(Point2::default());
        let seen = self.last[sector(heading + curionav_planning::numerics::atan2(point.y, point.x))];
        // The rounding of stamps must not cost a scan.
        distance <= radius + MARGIN || distance <= self.reach && now - seen <= REMEMBERED + 1e-6
    }
}

/// A point so many metres from the centre of a robot at `pose`.
fn at_bearing(pose: Pose2, bearing: f64, metres: f64) -> Point2 {
    let (sin, cos) = curionav_planning::numerics::sin_cos(bearing);
    pose.transform(Point2::new(metres * cos, metres * sin))
}

fn sector(direction: f64) -> usize {
    let turn = direction.rem_euclid(TAU) / TAU;
    ((turn * SECTORS as f64) as usize).min(SECTORS - 1)
}

#[cfg(test)]
#[path = "seen_way_tests.rs"]
mod tests;
