//! What a recording of this project holds of a robot, as a log.

use std::collections::BTreeMap;

use anyhow::{Context, ensure};
use curionav_planning::geometry::Pose2;
use curionav_planning::sensor::LaserModel;
use curionav_runtime::convert;
use curionav_schemas::{Belief, OccupancyGrid, Odometry, RunResult, Scan};

use super::carmen::Scanner;
use super::{Faults, Log, Reading};

/// A clock that goes back this far begins another run, seconds.
const ANEW_S: f64 = 1.0;

/// The messages of one robot in the order in which they were recorded.
#[derive(Debug, Clone, Default)]
pub struct Recorded {
    /// The map of its mission.
    pub map: Option<OccupancyGrid>,
    /// What its laser saw.
    pub scans: Vec<Scan>,
    /// How far it had driven.
    pub odometry: Vec<Odometry>,
    /// Where it believed it was.
    pub beliefs: Vec<Belief>,
    /// The end of the first simulated run, which tells where it truly was.
    pub result: Option<RunResult>,
}

/// The first run of a recording as a log. Its references are where the robot truly was or, if the recording does not
/// tell, where it believed it was; which of them, the words say.
///
/// # Errors
/// If no scan has odometry of the same tick, or a scan describes no scanner.
pub(crate) fn log(recorded: &Recorded, scanner: Scanner) -> anyhow::Result<(Log, &'static str)> {
    let (scans, later) = first_run(&recorded.scans, |scan| scan.stamp);
    let (odometry, _) = first_run(&recorded.odometry, |odometry| odometry.stamp);
    let (beliefs, _) = first_run(&recorded.beliefs, |belief| belief.stamp);
    let truth = recorded.result.as_ref().map_or_else(Vec::new, true_poses);
    let believed = || beliefs.iter().map(|b| (b.stamp, Pose2::new(b.x, b.y, b.heading))).collect();
    let by_tick: BTreeMap<u64, &Odometry> =
        odometry.iter().map(|odometry| (odometry.tick, odometry)).collect();
    let mut readings = Vec::with_capacity(scans.len());
    for scan in scans {
        let Some(at) = by_tick.get(&scan.tick) else { continue };
        let seen = convert::scan(scan, LaserModel::default().range_sigma);
        let (ranges, mut laser) = seen.with_context(|| format!("the scan of tick {}", scan.tick))?;
        laser.range_max = laser.range_max.min(scanner.range_max);
        if let Some(pose) = scanner.robot_from_laser {
            laser.robot_from_laser = pose;
        }
        let stamp = scan.stamp;
        let odometry = Pose2::new(at.x, at.y, at.heading);
        readings.push(Reading { stamp, ranges: ranges.into_owned(), laser, odometry, reference: None });
    }
    ensure!(!readings.is_empty(), "it has no scan with odometry of the same tick");
    let mut log = Log::of(readings, Faults { later_runs: later, ..Faults::default() });
    let (references, what) = match truth.is_empty() {
        true => (believed(), "where the robot believed it was"),
        false => (truth, "where the robot truly was"),
    };
    log.take_references(&references);
    Ok((log, what))
}

/// The messages of the first run, and how many runs follow.
fn first_run<T>(messages: &[T], stamp: fn(&T) -> f64) -> (&[T], usize) {
    let mut starts = (1..messages.len()).filter(|&i| stamp(&messages[i]) < stamp(&messages[i - 1]) - ANEW_S);
    match starts.next() {
        Some(end) => (&messages[..end], 1 + starts.count()),
        None => (messages, 0),
    }
}

/// Where the robot truly was, by time.
fn true_poses(result: &RunResult) -> Vec<(f64, Pose2)> {
    let column = |name: &str| result.trace.column(name);
    let poses = column("true_x").zip(column("true_y")).zip(column("true_heading"));
    column("time_s").zip(poses.map(|((x, y), heading)| Pose2::new(x, y, heading))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    const SCANNER: Scanner = Scanner { range_max: 30.0, robot_from_laser: None };

    /// A robot that drives along x with 0.1 m per tick, in two runs.
    fn recorded() -> Recorded {
        let stamp = |tick: u64| 0.1 * tick as f64;
        let ticks = || (0..30_u64).chain(0..5);
        let scan = |tick| Scan { tick, stamp: stamp(tick), ..golden::scan() };
        let odometry = |tick| Odometry {
            tick,
            stamp: stamp(tick),
            x: stamp(tick),
            y: 0.0,
            heading: 0.0,
            v: 1.0,
            omega: 0.0,
        };
        let belief = |tick| Belief {
            tick,
            stamp: stamp(tick),
            x: 5.0 + stamp(tick),
            y: 1.0,
            heading: 0.0,
            ..golden::belief()
        };
        Recorded {
            scans: ticks().map(scan).collect(),
            odometry: ticks().map(odometry).collect(),
            beliefs: ticks().map(belief).collect(),
            ..Recorded::default()
        }
    }

    #[test]
    fn the_first_run_is_a_log_against_what_the_robot_believed_or_where_it_was() {
        let mut recorded = recorded();
        let (log, what) = log(&recorded, SCANNER).unwrap();
        assert!(what.contains("believed"));
        assert_eq!((log.readings.len(), log.faults.later_runs, log.faults.disordered_scans), (30, 1, 0));
        let last = &log.readings[29];
        assert!((last.odometry.x - 2.9).abs() < 1e-9);
        assert!((last.reference.unwrap().x - 7.9).abs() < 1e-9);
        let mut result = golden::run_result();
        result.trace.columns = ["time_s", "true_x", "true_y", "true_heading"].map(String::from).to_vec();
        result.trace.values = (0..30).flat_map(|k| [0.1 * f64::from(k), f64::from(k), 0.0, 0.0]).collect();
        recorded.result = Some(result);
        assert_eq!(super::log(&recorded, SCANNER).unwrap().0.readings[29].reference.unwrap().x, 29.0);
    }

    #[test]
    fn a_scan_without_odometry_of_its_tick_says_nothing() {
        let mut recorded = recorded();
        recorded.odometry.retain(|odometry| odometry.tick % 2 == 0);
        assert_eq!(log(&recorded, SCANNER).unwrap().0.readings.len(), 15);
        recorded.odometry.clear();
        assert!(log(&recorded, SCANNER).unwrap_err().to_string().contains("no scan with odometry"));
    }
}
