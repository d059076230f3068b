//! What a log tells of the robot that recorded it: how noisy its odometry is, how late its scans are, and where its
//! laser sits. The truth that this is held against is the localiser's own track.

use curionav_localization::{Scan, ScanMatcher};
use curionav_planning::geometry::{Point2, Pose2, wrap_angle};
use curionav_planning::motion::OdometryNoise;
use nalgebra::{DMatrix, DVector};

use super::drive::{Drive, Track};
use super::least_squares::{not_negative, unbounded};
use crate::robot_log::Log;

/// What was found.
#[derive(Debug, Clone, Copy)]
pub(super) struct Fitted {
    pub(super) noise: OdometryNoise,
    /// How long before its stamp a scan was taken, seconds; none if scans come too rarely to tell.
    pub(super) delay_s: Option<f64>,
    /// Where the laser sits on the robot.
    pub(super) laser: Pose2,
    /// Metres that odometry counts per metre driven.
    pub(super) odometry_scale: f64,
}

/// Delays that are tried: so many steps from none on.
const DELAY_STEPS: usize = 50;
/// Seconds.
const DELAY_STEP_S: f64 = 0.01;
/// A stretch by which the delay is judged, seconds.
const STRETCH_S: f64 = 1.0;
/// Metres driven, or radians turned, within windows by which errors of position and of heading are judged: short ones
/// for the position, which an error of heading spoils over a longer way.
const POSITION_WINDOWS: [f64; 3] = [0.5, 1.0, 2.0];
const HEADING_WINDOWS: [f64; 4] = [1.0, 2.0, 4.0, 8.0];
/// Windows that tell anything of noise.
const WINDOWS_MIN: usize = 20;
/// No base is better than a hundredth of the usual one.
const LEAST_SHARE: f64 = 0.01;

/// A stretch of the log, by the localiser and by odometry.
#[derive(Debug, Clone, Copy)]
struct Window {
    localised: Pose2,
    odometry: Pose2,
    travel: f64,
    turn: f64,
}

impl Fitted {
    /// Times that the log is driven.
    pub(super) const DRIVES: usize = 2;

    /// Fits the log of a drive. `progress` is told how many readings are done.
    ///
    /// # Errors
    /// If too little of the log is driven where the localiser is sure.
    pub(super) fn of(drive: &Drive, seed: u64, mut progress: impl FnMut(usize)) -> anyhow::Result<Self> {
        let count = drive.log.readings.len();
        let unaware = drive.track_delayed(0.0, seed, &mut progress)?;
        let delay_s = delay(drive, &matched(drive, &unaware));
        let track = drive.track_delayed(delay_s.unwrap_or(0.0), seed, |at| progress(count + at))?;
        let mount = Mount::of(&windows(&drive.log, &track, HEADING_WINDOWS[0]));
        let corrected = track.poses.iter().map(|pose| pose.compose(mount.robot_from_true)).collect();
        let track = Track { poses: corrected, ..track };
        let noise = noise(&drive.log, &track)?;
        let said = drive.log.readings[0].laser.robot_from_laser;
        let laser = mount.robot_from_true.relative(said);
        Ok(Self { noise, delay_s, laser, odometry_scale: mount.odometry_scale })
    }

    /// As the robot's configuration takes it.
    pub(super) fn toml(&self, log: &str) -> String {
        let OdometryNoise { position_per_metre, position_per_radian, heading_per_metre, heading_per_radian } =
            self.noise;
        let Pose2 { x, y, heading } = self.laser;
        let delay = match self.delay_s {
            Some(seconds) => format!("delay_s = {seconds:.3} # s"),
            None => "# delay_s: scans come too rarely to tell it".to_owned(),
        };
        format!(
            "# What `curionav localize --fit` found in {log}.\n\
             # The laser sits at {x:.3}, {y:.3} m and {heading:.4} rad on the robot; transforms say it, not this file.\n\
             # Odometry counts {:.3} m for each metre that is driven.\n\n\
             [scanner]\n\
             {delay}\n\n\
             [ros2.mission.odometry_noise]\n\
             position_per_metre = {position_per_metre:.6} # m2/m\n\
             position_per_radian = {position_per_radian:.6} # m2/rad\n\
             heading_per_metre = {heading_per_metre:.6} # rad2/m\n\
             heading_per_radian = {heading_per_radian:.6} # rad2/rad\n",
            self.odometry_scale
        )
    }
}

/// Where each scan fits the map best near the localiser's pose, whatever odometry says; none where that is not clear.
fn matched(drive: &Drive, track: &Track) -> Vec<Option<Pose2>> {
    let matcher = ScanMatcher::new(&drive.map);
    let mut matched = Vec::with_capacity(drive.log.readings.len());
    for (k, reading) in drive.log.readings.iter().enumerate() {
        let scan = Scan { ranges: &reading.ranges, laser: reading.laser };
        matched.push(if track.converged[k] { matcher.near(track.poses[k], &scan) } else { None });
    }
    matched
}

/// How long before its stamp a scan was taken: by so much earlier stretches of odometry are most like those between
/// scans. Seconds, between the delays that are tried by the parabola through the least; none if no stretch has scans
/// within it.
fn delay(drive: &Drive, matched: &[Option<Pose2>]) -> Option<f64> {
    if drive.log.typical_interval() > 0.5 * STRETCH_S {
        return None;
    }
    let mut errors = Vec::new();
    for step in 0..=DELAY_STEPS {
        let delay = DELAY_STEP_S * step as f64;
        errors.push((1..matched.len()).filter_map(|k| stretch_error(&drive.log, matched, k, delay)).sum());
    }
    Some(DELAY_STEP_S * least(&errors))
}

/// The squared difference between a stretch that ends with scan k and one of odometry so much earlier, metres and
/// radians. It lasts so long that speeds change within it, which a delay shows by: within a step only odometry's noise
/// differs.
fn stretch_error(log: &Log, matched: &[Option<Pose2>], k: usize, delay: f64) -> Option<f64> {
    let first = log.readings.partition_point(|reading| reading.stamp < log.readings[k].stamp - STRETCH_S);
    let seen = matched[first]?.relative(matched[k]?);
    let before = log.odometry_at(log.readings[first].stamp - delay);
    let moved = before.relative(log.odometry_at(log.readings[k].stamp - delay));
    let turned = wrap_angle(seen.heading - moved.heading);
    Some(seen.position().distance(moved.position()).powi(2) + turned * turned)
}

/// Where numbers that are one apart are least, by the parabola through the least and its neighbours.
fn least(numbers: &[f64]) -> f64 {
    let (at, _) = numbers.iter().enumerate().min_by(|a, b| a.1.total_cmp(b.1)).unwrap_or((0, &0.0));
    if at == 0 || at + 1 >= numbers.len() {
        return at as f64;
    }
    let before = numbers[at - 1] - numbers[at];
    let after = numbers[at + 1] - numbers[at];
    at as f64 + 0.5 * (before - after) / (before + after).max(f64::MIN_POSITIVE)
}

/// Stretches one after the other of so many metres driven or radians turned, where the localiser was sure at both ends.
fn windows(log: &Log, track: &Track, length: f64) -> Vec<Window> {
    let mut found = Vec::new();
    let mut from = 0;
    let mut travel = 0.0;
    let mut turn = 0.0;
    for k in 1..log.readings.len() {
        let step = log.readings[k - 1].odometry.relative(log.readings[k].odometry);
        travel += step.position().distance(Point2::default());
        turn += step.heading.abs();
        if travel < length && turn < length {
            continue;
        }
        if track.converged[from] && track.converged[k] {
            let localised = track.poses[from].relative(track.poses[k]);
            let odometry = log.readings[from].odometry.relative(log.readings[k].odometry);
            found.push(Window { localised, odometry, travel, turn });
        }
        from = k;
        travel = 0.0;
        turn = 0.0;
    }
    found
}

/// Where the robot truly is, seen from where the localiser puts it with a laser that sits elsewhere than it is said to.
struct Mount {
    robot_from_true: Pose2,
    odometry_scale: f64,
}

impl Mount {
    /// Planar hand-eye calibration by linear least squares: for a step L of the localiser and O of odometry, and the
    /// mount E that is sought, L E = E O, with odometry that may count too far.
    fn of(windows: &[Window]) -> Self {
        let mut rows = Vec::new();
        let mut wanted = Vec::new();
        for Window { localised, odometry, .. } in windows {
            let (sin, cos) = curionav_planning::numerics::sin_cos(localised.heading);
            rows.push([cos - 1.0, -sin, -odometry.x, odometry.y]);
            rows.push([sin, cos - 1.0, -odometry.y, -odometry.x]);
            wanted.extend([-localised.x, -localised.y]);
        }
        let matrix = DMatrix::from_fn(rows.len(), 4, |row, column| rows[row][column]);
        let Some(found) = unbounded(&matrix, &DVector::from_vec(wanted)) else {
            return Self { robot_from_true: Pose2::default(), odometry_scale: 1.0 };
        };
        let scale = found[2].hypot(found[3]);
        let heading = curionav_planning::numerics::atan2(found[3], found[2]);
        Self { robot_from_true: Pose2::new(found[0], found[1], heading), odometry_scale: 1.0 / scale }
    }
}

/// Variances per metre and radian that explain how far odometry and localiser part within windows.
fn noise(log: &Log, track: &Track) -> anyhow::Result<OdometryNoise> {
    let heading = HEADING_WINDOWS.iter().flat_map(|length| windows(log, track, *length));
    let heading = heading.map(|window| {
        let off = wrap_angle(window.localised.heading - window.odometry.heading);
        (window, off * off)
    });
    let [heading_per_metre, heading_per_radian] = per_metre_and_radian(&heading.collect::<Vec<_>>())?;
    let position = POSITION_WINDOWS.iter().flat_map(|length| windows(log, track, *length));
    let position = position.map(|window| {
        let off = window.localised.position().distance(window.odometry.position());
        let from_heading = (heading_per_metre * window.travel + heading_per_radian * window.turn)
            * window.travel.powi(2)
            / 3.0;
        // Of each axis of the robot.
        (window, 0.5 * (off * off - from_heading).max(0.0))
    });
    let [position_per_metre, position_per_radian] = per_metre_and_radian(&position.collect::<Vec<_>>())?;
    let least = OdometryNoise::default();
    Ok(OdometryNoise {
        position_per_metre: position_per_metre.max(LEAST_SHARE * least.position_per_metre),
        position_per_radian: position_per_radian.max(LEAST_SHARE * least.position_per_radian),
        heading_per_metre: heading_per_metre.max(LEAST_SHARE * least.heading_per_metre),
        heading_per_radian: heading_per_radian.max(LEAST_SHARE * least.heading_per_radian),
    })
}

/// Fits squares of errors by a part that grows with the way and one that grows with the turn. What the localiser errs
/// by is in them: a filter that trusts odometry a little too little is right, and one that trusts it too much is lost.
/// A square varies as its mean does, so each counts by its share of what it is expected to be.
fn per_metre_and_radian(errors: &[(Window, f64)]) -> anyhow::Result<[f64; 2]> {
    anyhow::ensure!(
        errors.len() >= WINDOWS_MIN,
        "only {} stretches of the log can be used to fit noise, {WINDOWS_MIN} are needed: give a longer part of it",
        errors.len()
    );
    let matrix = DMatrix::from_fn(errors.len(), 2, |row, column| {
        let Window { travel, turn, .. } = errors[row].0;
        [travel, turn][column] / (travel + turn)
    });
    let wanted = DVector::from_fn(errors.len(), |row, _| {
        let (Window { travel, turn, .. }, square) = errors[row];
        square / (travel + turn)
    });
    let found = not_negative(&matrix, &wanted);
    Ok([found[0], found[1]])
}
