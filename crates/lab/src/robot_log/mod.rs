//! A log of a laser and odometry, whatever it was read from, made fit for a filter: in the order of time, with odometry
//! composed from its increments.

pub(crate) mod annotations;
pub(crate) mod arguments;
pub(crate) mod carmen;
pub(crate) mod drive_arguments;
pub(crate) mod recorded;
pub(crate) mod robot_file;

pub use drive_arguments::{DriveArguments, RecordingReader};
pub use recorded::Recorded;

use std::borrow::Cow;

use curionav_planning::geometry::{Pose2, wrap_angle};
use curionav_planning::sensor::LaserModel;

/// One scan, and where the robot was by odometry.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Reading {
    /// Seconds on the log's clock.
    pub(crate) stamp: f64,
    /// Metres, by beam.
    pub(crate) ranges: Vec<f32>,
    /// The scanner.
    pub(crate) laser: LaserModel,
    /// Odometry frame, as logged.
    pub(crate) odometry: Pose2,
    /// The pose that the log gives beside odometry, such as that of a map builder.
    pub(crate) reference: Option<Pose2>,
}

/// What was wrong with a log and was mended or left out.
#[derive(Debug, Clone, Default, PartialEq, serde::Serialize)]
pub(crate) struct Faults {
    /// Lines that could not be read.
    pub(crate) broken_lines: usize,
    /// The first of them, and why.
    pub(crate) first_broken: Option<String>,
    /// Scans that are no newer than the one before.
    pub(crate) disordered_scans: usize,
    /// Times at which the clock was set back by a second or more.
    pub(crate) clock_set_back: usize,
    /// Times without a scan for two seconds or longer.
    pub(crate) gaps: usize,
    /// Times at which odometry began anew at another place.
    pub(crate) odometry_restarts: usize,
    /// Whether no stamps tell when its scans were taken. They then count as one second apart.
    pub(crate) without_clock: bool,
    /// Runs of a recording after the first, which are left out.
    pub(crate) later_runs: usize,
}

impl Faults {
    /// What was wrong with the log, a line each.
    pub(crate) fn lines(&self) -> Vec<String> {
        let first = self.first_broken.as_ref().map_or(String::new(), |first| format!(" ({first})"));
        let broken = format!("lines that cannot be read{first}");
        let counts = [
            (self.broken_lines, broken.as_str()),
            (self.disordered_scans, "scans that are no newer than the one before"),
            (self.clock_set_back, "times at which the clock was set back"),
            (self.gaps, "gaps of two seconds or longer"),
            (self.odometry_restarts, "restarts of odometry"),
            (self.later_runs, "later runs of the recording, which are left out"),
        ];
        let happened = counts.into_iter().filter(|(count, _)| *count > 0);
        let mut lines: Vec<String> = happened.map(|(count, what)| format!("  {count} {what}")).collect();
        if self.without_clock {
            lines.push(
                "  no stamps that tell when scans were taken: they count as one second apart".to_owned(),
            );
        }
        lines
    }
}

/// A log that a filter can take.
#[derive(Debug, Clone, Default, PartialEq)]
pub(crate) struct Log {
    pub(crate) readings: Vec<Reading>,
    pub(crate) faults: Faults,
}

/// Longest time between scans that is no gap, seconds.
const GAP_S: f64 = 2.0;
/// A clock that goes back this far was set, seconds; less is disorder.
const SET_BACK_S: f64 = 1.0;
/// Seconds that pass while a clock is set back: nothing says how many, and time has to go on.
const STEP_S: f64 = 1e-3;
/// Faster than this no robot moves, m/s and rad/s: odometry was restarted.
const FASTEST: f64 = 4.0;
/// Metres, and radians, that odometry may be off between two readings besides.
const SLACK: f64 = 0.5;
/// Odometry that was restarted counts from nought, but for what was driven until the next scan: metres and radians.
const NOUGHT: f64 = 1.0;

/// Makes the stamps of a log go on where its clock was set back.
#[derive(Debug, Default)]
pub(crate) struct Clock {
    last: Option<f64>,
    offset: f64,
    pub(crate) set_back: usize,
}

impl Clock {
    /// The time of a line with this stamp, seconds.
    pub(crate) fn time(&mut self, stamp: f64) -> f64 {
        let last = self.last.unwrap_or(stamp + self.offset);
        if stamp + self.offset < last - SET_BACK_S {
            self.offset = last + STEP_S - stamp;
            self.set_back += 1;
        }
        let time = stamp + self.offset;
        self.last = Some(last.max(time));
        time
    }
}

impl Log {
    /// Puts readings, as they came, in the order of time. The odometry of each is composed from the increments before
    /// it; an increment that no robot can drive counts as none.
    pub(crate) fn of(readings: Vec<Reading>, mut faults: Faults) -> Self {
        let interval = typical_interval(&readings);
        let mut kept: Vec<Reading> = Vec::with_capacity(readings.len());
        let mut last: Option<(f64, Pose2)> = None;
        for mut reading in readings {
            let raw = reading.odometry;
            let stamp = reading.stamp;
            if let (Some((before, from)), Some(kept)) = (last, kept.last()) {
                if stamp <= before {
                    faults.disordered_scans += 1;
                    continue;
                }
                faults.gaps += usize::from(stamp - before >= GAP_S);
                let moved = from.relative(raw);
                let restarted = is_restart(moved, raw, stamp - before, interval);
                faults.odometry_restarts += usize::from(restarted);
                reading.odometry = if restarted { kept.odometry } else { kept.odometry.compose(moved) };
            }
            last = Some((stamp, raw));
            kept.push(reading);
        }
        Self { readings: kept, faults }
    }

    /// Seconds from the first scan to the last.
    pub(crate) fn duration(&self) -> f64 {
        let stamp = |reading: Option<&Reading>| reading.map_or(0.0, |reading| reading.stamp);
        stamp(self.readings.last()) - stamp(self.readings.first())
    }

    /// Metres driven by odometry.
    pub(crate) fn length(&self) -> f64 {
        let poses = self.readings.windows(2).map(|pair| [pair[0].odometry, pair[1].odometry]);
        poses.map(|[a, b]| a.position().distance(b.position())).sum()
    }

    /// The median time between scans, seconds.
    pub(crate) fn typical_interval(&self) -> f64 {
        typical_interval(&self.readings)
    }

    /// Odometry at a time between readings, on the straight line; before the first and after the last it stands.
    pub(crate) fn odometry_at(&self, stamp: f64) -> Pose2 {
        let next = self.readings.partition_point(|reading| reading.stamp <= stamp);
        let Some(before) = next.checked_sub(1) else { return self.readings[0].odometry };
        let before = &self.readings[before];
        let Some(after) = self.readings.get(next) else { return before.odometry };
        let share = (stamp - before.stamp) / (after.stamp - before.stamp);
        before.odometry.toward(after.odometry, share)
    }

    /// The log of a laser that saw its scans so much earlier than they are stamped, seconds: its place on the robot is
    /// the one it had then.
    pub(crate) fn delayed(&self, delay_s: f64) -> Cow<'_, Self> {
        if delay_s == 0.0 {
            return Cow::Borrowed(self);
        }
        let mut log = self.clone();
        for (reading, now) in log.readings.iter_mut().zip(&self.readings) {
            let then = self.odometry_at(now.stamp - delay_s);
            let moved = now.odometry.relative(then);
            reading.laser.robot_from_laser = moved.compose(now.laser.robot_from_laser);
        }
        Cow::Owned(log)
    }

    /// The part of the log between two times, seconds after its first scan.
    pub(crate) fn part(mut self, from_s: f64, to_s: f64) -> Self {
        let begins = self.readings.first().map_or(0.0, |reading| reading.stamp);
        self.readings.retain(|reading| (from_s..=to_s).contains(&(reading.stamp - begins)));
        self
    }

    /// The number of the scan that is nearest to a time, if it is at most `within_s` seconds off.
    pub(crate) fn nearest(&self, stamp: f64, within_s: f64) -> Option<usize> {
        nearest(&self.readings, |reading| reading.stamp, stamp, within_s)
    }

    /// Takes the references of another log of the same scans, such as the one that a map builder has corrected: those
    /// nearest in time, if they are within 0.05 s. Says how many there were.
    pub(crate) fn take_references(&mut self, stamps_and_poses: &[(f64, Pose2)]) -> usize {
        const NEAR_S: f64 = 0.05;
        let mut taken = 0;
        for reading in &mut self.readings {
            let found = nearest(stamps_and_poses, |(stamp, _)| *stamp, reading.stamp, NEAR_S);
            reading.reference = found.map(|at| stamps_and_poses[at].1);
            taken += usize::from(reading.reference.is_some());
        }
        taken
    }
}

/// The place in a list in the order of time of what is nearest to a time, if it is at most `within_s` seconds off.
fn nearest<T>(list: &[T], time: impl Fn(&T) -> f64, stamp: f64, within_s: f64) -> Option<usize> {
    let next = list.partition_point(|one| time(one) < stamp);
    let around = next.saturating_sub(1)..list.len().min(next + 1);
    let apart = around.map(|at| (at, (time(&list[at]) - stamp).abs()));
    let (at, seconds) = apart.min_by(|(_, a), (_, b)| a.total_cmp(b))?;
    (seconds <= within_s).then_some(at)
}

/// The median time between scans, seconds.
fn typical_interval(readings: &[Reading]) -> f64 {
    let mut seconds: Vec<f64> = readings.windows(2).map(|pair| pair[1].stamp - pair[0].stamp).collect();
    seconds.sort_by(f64::total_cmp);
    seconds.get(seconds.len() / 2).map_or(0.0, |median| median.max(0.0))
}

/// Whether odometry that has `moved` so within `seconds`, to `raw`, has begun anew. Stamps of some logs stand closer
/// together than the scans were taken, so a quick turn alone is no sign of it.
fn is_restart(moved: Pose2, raw: Pose2, seconds: f64, interval: f64) -> bool {
    let at_nought = is_near(raw, Pose2::default(), NOUGHT);
    !can_be_driven(moved, seconds.max(interval)) || (at_nought && !can_be_driven(moved, seconds))
}

fn can_be_driven(moved: Pose2, seconds: f64) -> bool {
    is_near(moved, Pose2::default(), SLACK + FASTEST * seconds)
}

/// Whether two poses are the same but for `apart` metres, and radians.
pub(crate) fn is_near(a: Pose2, b: Pose2, apart: f64) -> bool {
    a.position().distance(b.position()) <= apart && wrap_angle(a.heading - b.heading).abs() <= apart
}

#[cfg(test)]
mod tests {
    use super::*;

    fn reading(stamp: f64, x: f64) -> Reading {
        let odometry = Pose2::new(x, 0.0, 0.0);
        Reading { stamp, ranges: vec![1.0; 3], laser: LaserModel::default(), odometry, reference: None }
    }

    fn of(readings: &[(f64, f64)]) -> Log {
        Log::of(readings.iter().map(|(stamp, x)| reading(*stamp, *x)).collect(), Faults::default())
    }

    #[test]
    fn odometry_that_begins_anew_goes_on_from_where_it_was() {
        let log = of(&[(0.0, 7.0), (0.2, 7.1), (0.4, 0.0), (0.6, 0.1), (0.8, 0.2)]);
        let x: Vec<f64> = log.readings.iter().map(|reading| reading.odometry.x).collect();
        let expected = [7.0, 7.1, 7.1, 7.2, 7.3];
        assert!(x.iter().zip(expected).all(|(x, e)| (x - e).abs() < 1e-12), "{x:?}");
        assert_eq!((log.faults.odometry_restarts, log.faults.gaps), (1, 0));
    }

    #[test]
    fn gaps_are_counted_and_what_was_driven_in_them_is_kept() {
        let log = of(&[(0.0, 0.0), (10.0, 8.0), (10.2, 8.1)]);
        assert_eq!((log.faults.gaps, log.faults.odometry_restarts), (1, 0));
        assert!((log.readings[2].odometry.x - 8.1).abs() < 1e-12 && (log.length() - 8.1).abs() < 1e-12);
    }

    #[test]
    fn scans_that_are_no_newer_are_left_out() {
        let log = of(&[(1.0, 0.0), (1.0, 0.5), (0.9, 0.5), (1.2, 0.2)]);
        assert_eq!((log.readings.len(), log.faults.disordered_scans), (2, 2));
        assert!((log.readings[1].odometry.x - 0.2).abs() < 1e-12);
    }

    #[test]
    fn a_clock_that_is_set_back_goes_on() {
        let mut clock = Clock::default();
        let times = [10.0, 10.2, 10.1, 3.0, 3.2].map(|stamp| clock.time(stamp));
        assert_eq!(times.map(|time| (10.0 * time).round() / 10.0), [10.0, 10.2, 10.1, 10.2, 10.4]);
        assert_eq!(clock.set_back, 1);
    }

    #[test]
    fn a_late_laser_sits_where_it_was() {
        let log = of(&[(0.0, 0.0), (0.2, 0.1), (0.4, 0.3), (0.6, 0.5)]);
        let late = log.delayed(0.3);
        let x: Vec<f64> = late.readings.iter().map(|r| r.laser.robot_from_laser.x).collect();
        // At 0.1 s it was at 0.05 m, at 0.3 s at 0.2 m; before the first reading it stood.
        let expected = [0.0, -0.1, -0.25, -0.3];
        assert!(x.iter().zip(expected).all(|(x, e)| (x - e).abs() < 1e-12), "{x:?}");
    }

    #[test]
    fn references_of_another_log_are_those_of_the_same_moment() {
        let mut log = of(&[(0.0, 0.0), (0.2, 0.1), (0.4, 0.2)]);
        let other = [(0.01, Pose2::new(5.0, 0.0, 0.0)), (0.39, Pose2::new(6.0, 0.0, 0.0))];
        assert_eq!(log.take_references(&other), 2);
        let x: Vec<Option<f64>> = log.readings.iter().map(|r| r.reference.map(|pose| pose.x)).collect();
        assert_eq!(x, [Some(5.0), None, Some(6.0)]);
    }
}
