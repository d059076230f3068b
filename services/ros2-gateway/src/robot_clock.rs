//! The robot's clock: the stamps of its odometry, and the ticks that they make.

use std::collections::VecDeque;

use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::step;
use curionav_ros2::messages::Time;
use curionav_runtime::convert;
use curionav_schemas::Scan;

/// Odometry that is remembered: of more than a second at a hundred hertz.
const REMEMBERED: usize = 128;
/// A stamp that lies further back than this is of a clock that has been set back, seconds; a lesser one is late.
const JUMP_BACK: f64 = 0.5;
/// Odometry that comes sooner than this share of a tick after the last tick makes none.
const TICK_SHARE: f64 = 0.75;
/// How far past the newest odometry a pose is foretold, seconds.
const AHEAD_MAX: f64 = 0.3;

/// One sample of odometry, as a tick.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Sample {
    /// Its number.
    pub(crate) tick: u64,
    /// Seconds since the first.
    pub(crate) stamp: f64,
    /// Where the robot is by dead reckoning.
    pub(crate) pose: Pose2,
    /// How it moves.
    pub(crate) twist: Twist,
}

/// What a sample of odometry is to the clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Moment {
    /// The next tick.
    Tick(Sample),
    /// Too soon after the last tick for another, or late.
    Between,
    /// The clock has been set back: nothing of before is of any use.
    SetBack,
}

/// The clock of one robot.
#[derive(Debug)]
pub(crate) struct RobotClock {
    tick_s: f64,
    /// Nanoseconds that count as 0.
    origin: Option<i64>,
    samples: VecDeque<Sample>,
}

impl RobotClock {
    /// Not yet begun; a tick takes `tick_s` seconds.
    pub(crate) fn new(tick_s: f64) -> Self {
        Self { tick_s, origin: None, samples: VecDeque::new() }
    }

    /// A stamp in seconds since the first sample of odometry; nothing before it.
    pub(crate) fn seconds(&self, stamp: Time) -> Option<f64> {
        // Years of nanoseconds fit in 53 bits to a microsecond or so.
        self.origin.map(|origin| stamp.nanoseconds().saturating_sub(origin) as f64 * 1e-9)
    }

    /// The stamp of so many seconds since the first sample.
    pub(crate) fn stamp(&self, seconds: f64) -> Time {
        Time::from_nanoseconds(self.origin.unwrap_or(0).saturating_add((seconds * 1e9).round() as i64))
    }

    /// The newest tick.
    pub(crate) fn newest(&self) -> Option<&Sample> {
        self.samples.back()
    }

    /// The sample of a tick, while it is remembered.
    pub(crate) fn of_tick(&self, tick: u64) -> Option<&Sample> {
        self.samples.iter().rev().find(|sample| sample.tick == tick)
    }

    /// Takes note of odometry. After a clock that was set back, the next sample is the first of a new one.
    pub(crate) fn measured(&mut self, stamp: Time, pose: Pose2, twist: Twist) -> Moment {
        let origin = *self.origin.get_or_insert(stamp.nanoseconds());
        let seconds = stamp.nanoseconds().saturating_sub(origin) as f64 * 1e-9;
        let next = match self.samples.back() {
            Some(last) if seconds < last.stamp - JUMP_BACK => {
                *self = Self::new(self.tick_s);
                return Moment::SetBack;
            }
            Some(last) if seconds < last.stamp + TICK_SHARE * self.tick_s => return Moment::Between,
            last => last.map_or(0, |last| last.tick + 1),
        };
        if self.samples.len() == REMEMBERED {
            self.samples.pop_front();
        }
        let sample = Sample { tick: next, stamp: seconds, pose, twist };
        self.samples.push_back(sample);
        Moment::Tick(sample)
    }

    /// A scan as it is seen from where the robot is at a tick; nothing if it is not known where it was taken.
    pub(crate) fn seen_at(&self, sample: &Sample, scan: Scan) -> Option<Scan> {
        let moved = sample.pose.relative(self.pose_at(scan.stamp)?);
        let laser = convert::pose_to_wire(moved.compose(convert::pose(scan.laser)));
        Some(Scan { tick: sample.tick, laser, ..scan })
    }

    /// Where the robot was by dead reckoning at a stamp, seconds since the first sample: between two samples on the
    /// straight line, and a little past the newest as it moved then. Nothing of before what is remembered.
    pub(crate) fn pose_at(&self, stamp: f64) -> Option<Pose2> {
        let newest = self.samples.back()?;
        if stamp >= newest.stamp {
            let ahead = stamp - newest.stamp;
            return (ahead <= AHEAD_MAX).then(|| step(newest.pose, newest.twist, ahead));
        }
        let after = self.samples.iter().rposition(|sample| sample.stamp <= stamp)?;
        let before = self.samples.get(after)?;
        let after = self.samples.get(after + 1)?;
        let share = (stamp - before.stamp) / (after.stamp - before.stamp);
        Some(before.pose.toward(after.pose, share))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(milliseconds: i64) -> Time {
        Time::from_nanoseconds(1_800_000_000_000_000_000 + milliseconds * 1_000_000)
    }

    fn moved(clock: &mut RobotClock, milliseconds: i64, x: f64) -> Moment {
        clock.measured(at(milliseconds), Pose2::new(x, 0.0, 0.0), Twist { v: 1.0, omega: 0.0 })
    }

    #[test]
    fn every_sample_is_a_tick_unless_it_comes_too_soon() {
        let mut clock = RobotClock::new(0.1);
        assert_eq!(clock.seconds(at(0)), None);
        let ticks = [0, 100, 120, 198, 199, 310].map(|ms| match moved(&mut clock, ms, 0.0) {
            Moment::Tick(sample) => Some((sample.tick, (sample.stamp * 1e3).round() as i64)),
            _ => None,
        });
        assert_eq!(ticks, [Some((0, 0)), Some((1, 100)), None, Some((2, 198)), None, Some((3, 310))]);
        assert_eq!(clock.stamp(clock.seconds(at(250)).unwrap()), at(250));
    }

    #[test]
    fn a_clock_that_is_set_back_begins_anew_and_a_late_sample_changes_nothing() {
        let mut clock = RobotClock::new(0.1);
        moved(&mut clock, 0, 0.0);
        moved(&mut clock, 10_000, 0.0);
        assert_eq!(moved(&mut clock, 9_800, 0.0), Moment::Between);
        assert_eq!(moved(&mut clock, 9_000, 0.0), Moment::SetBack);
        assert!(clock.newest().is_none());
        assert!(matches!(moved(&mut clock, 9_000, 0.0), Moment::Tick(Sample { tick: 0, stamp: 0.0, .. })));
    }

    #[test]
    fn the_pose_of_a_scan_lies_between_those_of_the_ticks() {
        let mut clock = RobotClock::new(0.1);
        for k in 0..300 {
            moved(&mut clock, 100 * k, 0.1 * k as f64);
        }
        let x = |stamp| clock.pose_at(stamp).map(|pose| (pose.x * 1e6).round() / 1e6);
        assert_eq!((x(29.85), x(29.9), x(30.0)), (Some(29.85), Some(29.9), Some(30.0)));
        // 0.4 s ahead of the newest, and from before what is remembered.
        assert_eq!((x(30.3), x(1.0)), (None, None));
    }
}
