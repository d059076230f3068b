//! A scan as one picture: its beams look one after the other, while the robot moves.

use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Point2, Pose2, wrap_angle};
use curionav_planning::numerics::{atan2, hypot, sin_cos};
use curionav_runtime::convert;
use curionav_schemas::Scan;

use crate::robot_clock::{RobotClock, Sample};

/// A scan that waits for the next odometry.
#[derive(Debug, Clone)]
pub(crate) struct Sweep {
    /// Its stamp is that of its first beam.
    pub(crate) scan: Scan,
    /// From one beam to the next, seconds.
    pub(crate) beam_s: f64,
}

/// A sweep that is over so soon shows one moment, seconds: at 1 rad/s its beams are off by half a degree.
const ONE_MOMENT_S: f64 = 0.01;

impl Sweep {
    /// The scan as it is seen from where the robot is at a tick, all beams as of the middle of the sweep. Nothing if it
    /// is not known where it was taken.
    pub(crate) fn seen_at(self, clock: &RobotClock, sample: &Sample) -> Option<Scan> {
        let Self { mut scan, beam_s } = self;
        let seconds = beam_s * scan.ranges.len().saturating_sub(1) as f64;
        if seconds.abs() > ONE_MOMENT_S {
            let mount = convert::pose(scan.laser);
            let first = clock.pose_at(scan.stamp)?.compose(mount);
            let last = clock.pose_at(scan.stamp + seconds)?.compose(mount);
            scan.ranges = straightened(&scan, first, last).into();
            scan.stamp += 0.5 * seconds;
        }
        clock.seen_at(sample, scan)
    }
}

/// The ranges that all beams would have if they had looked at once from half way between where the scanner was with the
/// `first` beam and with the `last`. A direction into which no beam looked says nothing.
fn straightened(scan: &Scan, first: Pose2, last: Pose2) -> Vec<f32> {
    let middle = first.toward(last, 0.5);
    let count = scan.ranges.len();
    let mut straight = vec![f32::NAN; count];
    for (index, &range) in scan.ranges.iter().enumerate() {
        if range.is_nan() {
            continue;
        }
        let share = index as f64 / (count - 1) as f64;
        let moved = middle.relative(first.toward(last, share));
        let bearing = scan.angle_min + index as f64 * scan.angle_increment;
        let met = matches!(Beam::of(range, 0.0, scan.range_max), Beam::Obstacle(_));
        let (turned, range) = if met { seen_from(moved, bearing, range) } else { (moved.heading, range) };
        let Some(place) = direction(scan, bearing + turned) else { continue };
        if straight[place].is_nan() || range < straight[place] {
            straight[place] = range;
        }
    }
    straight
}

/// By how much the bearing of a beam's end changes with the scanner's place, and its range from there.
fn seen_from(moved: Pose2, bearing: f64, range: f32) -> (f64, f32) {
    let (sin, cos) = sin_cos(bearing);
    let end = moved.transform(Point2::new(f64::from(range) * cos, f64::from(range) * sin));
    (wrap_angle(atan2(end.y, end.x) - bearing), hypot(end.x, end.y) as f32)
}

/// The beam that looks most nearly into a direction, if any does.
fn direction(scan: &Scan, bearing: f64) -> Option<usize> {
    let count = scan.ranges.len();
    let place = ((bearing - scan.angle_min) / scan.angle_increment).round() as i64;
    let goes_round =
        count as f64 * scan.angle_increment.abs() >= std::f64::consts::TAU - 0.5 * scan.angle_increment.abs();
    let place = if goes_round { place.rem_euclid(count as i64) } else { place };
    usize::try_from(place).ok().filter(|place| *place < count)
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Twist;
    use curionav_ros2::messages::Time;
    use curionav_schemas::Pose;

    use super::*;

    const BEAMS: usize = 181;
    /// A tenth of a second for the whole sweep.
    const BEAM_S: f64 = 0.1 / 180.0;

    /// Of a laser that looks over half a turn, at walls ahead (x = 3) and to both sides (y = 2, -2), while the robot
    /// moves like this from its origin on.
    fn swept(twist: Twist) -> (Scan, RobotClock) {
        let mut clock = RobotClock::new(0.1);
        for k in 0..3 {
            let seconds = 0.1 * f64::from(k);
            let pose = curionav_planning::motion::step(Pose2::default(), twist, seconds);
            clock.measured(Time::from_nanoseconds((1e9 * seconds) as i64), pose, twist);
        }
        let step = std::f64::consts::PI / 180.0;
        let ranges = (0..BEAMS).map(|i| {
            let pose = clock.pose_at(BEAM_S * i as f64).unwrap();
            let (sin, cos) = sin_cos(pose.heading - std::f64::consts::FRAC_PI_2 + step * i as f64);
            wall(pose, cos, sin) as f32
        });
        let scan = Scan {
            tick: 0,
            stamp: 0.0,
            angle_min: -std::f64::consts::FRAC_PI_2,
            angle_increment: step,
            range_min: Some(0.0),
            range_max: 10.0,
            laser: Pose::default(),
            ranges: ranges.collect(),
        };
        (scan, clock)
    }

    fn wall(from: Pose2, cos: f64, sin: f64) -> f64 {
        let ahead = if cos > 1e-9 { (3.0 - from.x) / cos } else { f64::INFINITY };
        let side = if sin.abs() > 1e-9 { (2.0 * sin.signum() - from.y) / sin } else { f64::INFINITY };
        ahead.min(side)
    }

    /// The greatest error of beams in the middle of walls, metres.
    fn error(scan: &Scan, from: Pose2) -> f64 {
        let off = |i: usize| {
            let (sin, cos) = sin_cos(from.heading + scan.angle_min + scan.angle_increment * i as f64);
            (f64::from(scan.ranges[i]) - wall(from, cos, sin)).abs()
        };
        [20, 40, 75, 90, 105, 140, 160].into_iter().map(off).fold(0.0, f64::max)
    }

    #[test]
    fn a_sweep_of_a_robot_that_turns_and_drives_shows_one_moment() {
        let (scan, clock) = swept(Twist { v: 1.0, omega: 1.0 });
        let middle = clock.pose_at(0.05).unwrap();
        let sample = *clock.of_tick(0).unwrap();
        let crooked = error(&scan, middle);
        let straight = Sweep { scan, beam_s: BEAM_S }.seen_at(&clock, &sample).unwrap();
        let seen_from = convert::pose(straight.laser);
        assert!(seen_from.position().distance(middle.position()) < 1e-9 && straight.stamp == 0.05);
        let left = error(&straight, middle);
        // The first and the last beams look 0.05 rad past each other.
        assert!(crooked > 0.05 && left < 0.02, "{crooked} {left}");
    }

    #[test]
    fn a_sweep_of_a_robot_that_stands_stays_as_it_is() {
        let (scan, clock) = swept(Twist::default());
        let sample = *clock.of_tick(2).unwrap();
        let straight = Sweep { scan: scan.clone(), beam_s: BEAM_S }.seen_at(&clock, &sample).unwrap();
        let most = straight.ranges.iter().zip(&*scan.ranges).map(|(a, b)| (a - b).abs()).fold(0.0, f32::max);
        assert!(most < 1e-5, "{most}");
    }

    #[test]
    fn beams_that_say_nothing_say_nothing_of_any_direction() {
        let (mut scan, _) = swept(Twist::default());
        scan.ranges.0[90] = f32::NAN;
        scan.ranges.0[91] = 10.0;
        let turned = Pose2::new(0.0, 0.0, 0.1);
        let straight = straightened(&scan, Pose2::default(), turned);
        assert!(straight.iter().any(|range| range.is_nan()));
        assert_eq!(straight.iter().filter(|range| **range == 10.0).count(), 1);
    }
}
