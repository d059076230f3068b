//! What `curionav localize` prints.

use comfy_table::Table;
use curionav_planning::geometry::Pose2;
use nalgebra::Matrix3;
use serde::Serialize;

use super::drive::{Consistency, Drive, Errors, Track};
use crate::robot_log::Faults;

/// Farther off than this the robot is elsewhere, metres.
const LOST_M: f64 = 1.0;

/// Figures of one drive.
#[derive(Debug, Serialize)]
pub(super) struct Summary {
    seed: u64,
    log: String,
    map: Option<String>,
    scans: usize,
    duration_s: f64,
    length_m: f64,
    #[serde(flatten)]
    faults: Faults,
    references: usize,
    references_are: String,
    /// Seconds after the first scan; nothing if it never was.
    converged_after_s: Option<f64>,
    /// Losses of convergence.
    lost_convergence: usize,
    /// Share of the scans at which it had converged more than a metre off.
    wrongly_converged: Option<f64>,
    /// From when it first had converged; of the whole log if it never had.
    localizer: Option<Errors>,
    odometry_alone: Option<Errors>,
    consistency: Option<Consistency>,
    /// The last pose: metres and radians.
    ends_at: [f64; 3],
    updates: usize,
    updates_per_second: f64,
    seconds_per_second: f64,
    picture: String,
}

impl Summary {
    pub(super) fn of(drive: &Drive, seed: u64, track: &Track, alone: &[Pose2]) -> Self {
        let log = &drive.log;
        let first = track.converged.iter().position(|is| *is);
        let from = first.unwrap_or(0);
        let estimates = referred(drive, &track.poses, from);
        let covariances: Vec<Matrix3<f64>> = (from..log.readings.len())
            .filter(|&k| log.readings[k].reference.is_some())
            .map(|k| track.covariances[k])
            .collect();
        Self {
            seed,
            log: drive.log_name.clone(),
            map: drive.map_name.clone(),
            scans: log.readings.len(),
            duration_s: log.duration(),
            length_m: log.length(),
            faults: log.faults.clone(),
            references: log.readings.iter().filter(|reading| reading.reference.is_some()).count(),
            references_are: drive.references_are.clone(),
            converged_after_s: first.map(|k| log.readings[k].stamp - log.readings[0].stamp),
            lost_convergence: track.converged.windows(2).filter(|pair| pair[0] && !pair[1]).count(),
            wrongly_converged: wrongly_converged(drive, track),
            localizer: Errors::of(&estimates),
            odometry_alone: Errors::of(&referred(drive, alone, from)),
            consistency: Consistency::of(&estimates, &covariances),
            ends_at: track.poses.last().map_or([0.0; 3], |pose| [pose.x, pose.y, pose.heading]),
            updates: track.updates,
            updates_per_second: track.updates as f64 / track.wall_s.max(1e-9),
            seconds_per_second: log.duration() / track.wall_s.max(1e-9),
            picture: drive.picture.clone(),
        }
    }

    pub(super) fn is_lost(&self) -> bool {
        self.localizer.is_some_and(|errors| errors.at_end_m > LOST_M)
    }

    pub(super) fn words(&self) -> String {
        let mut lines = vec![format!(
            "{}: {} scans in {:.0} s, {:.0} m by odometry",
            self.log, self.scans, self.duration_s, self.length_m
        )];
        lines.extend(self.faults.lines());
        lines.push(match self.converged_after_s {
            Some(after) => {
                format!("converged after {after:.1} s; convergence lost {} times", self.lost_convergence)
            }
            None => "never converged".to_owned(),
        });
        if let (Some(filter), Some(alone)) = (self.localizer, self.odometry_alone) {
            let table = error_table(filter, alone);
            lines.push(format!("against {} references, {}:\n{table}", self.references, self.references_are));
        }
        if let Some(share) = self.wrongly_converged.filter(|share| *share > 0.0) {
            lines.push(format!(
                "sure of a place more than {LOST_M} m off at {:.1} % of the scans",
                100.0 * share
            ));
        }
        if let Some(Consistency { mean, share_within_95 }) = self.consistency {
            lines.push(format!(
                "covariance: normalised squared error {mean:.1} on average (3 is honest), {:.0} % within the 95 % \
                 region",
                100.0 * share_within_95
            ));
        }
        lines.push(format!(
            "{} filter updates, {:.0} per second; {:.0} times as fast as it was driven",
            self.updates, self.updates_per_second, self.seconds_per_second
        ));
        let [x, y, heading] = self.ends_at;
        lines.push(format!("ends at {x:.2},{y:.2},{heading:.2}; the tracks are in {}", self.picture));
        lines.join("\n")
    }
}

fn error_table(filter: Errors, alone: Errors) -> Table {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::UTF8_BORDERS_ONLY);
    table.set_header(["error", "localiser", "odometry alone"]);
    let rows = [
        ("median, m", filter.median_m, alone.median_m),
        ("mean, m", filter.mean_m, alone.mean_m),
        ("95 % below, m", filter.p95_m, alone.p95_m),
        ("greatest, m", filter.greatest_m, alone.greatest_m),
        ("at the end, m", filter.at_end_m, alone.at_end_m),
        ("heading, median, degrees", filter.heading_median_deg, alone.heading_median_deg),
    ];
    for (what, filter, alone) in rows {
        table.add_row([what.to_owned(), format!("{filter:.2}"), format!("{alone:.2}")]);
    }
    table
}

/// Poses from the scan of this number on, with the references that they have.
fn referred(drive: &Drive, poses: &[Pose2], from: usize) -> Vec<(Pose2, Pose2)> {
    let pairs = poses.iter().zip(&drive.log.readings).skip(from);
    pairs.filter_map(|(pose, reading)| Some((*pose, reading.reference?))).collect()
}

fn wrongly_converged(drive: &Drive, track: &Track) -> Option<f64> {
    let mut referred = 0;
    let mut wrong = 0;
    for (k, reading) in drive.log.readings.iter().enumerate() {
        let Some(reference) = reading.reference else { continue };
        let is_off = track.poses[k].position().distance(reference.position()) > LOST_M;
        referred += 1;
        wrong += usize::from(track.converged[k] && is_off);
    }
    (referred > 0).then(|| f64::from(wrong as u32) / f64::from(referred as u32))
}

/// A row for each seed.
pub(super) fn table(summaries: &[Summary]) -> String {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::UTF8_BORDERS_ONLY);
    table.set_header([
        "seed",
        "median, m",
        "95 % below, m",
        "at the end, m",
        "NEES",
        "within 95 %",
        "converged after, s",
        "wrongly converged, %",
        "updates per s",
    ]);
    for summary in summaries {
        let Summary { localizer, consistency, .. } = summary;
        table.add_row([
            summary.seed.to_string(),
            number(localizer.map(|errors| errors.median_m), 2),
            number(localizer.map(|errors| errors.p95_m), 2),
            number(localizer.map(|errors| errors.at_end_m), 2),
            number(consistency.map(|it| it.mean), 1),
            number(consistency.map(|it| 100.0 * it.share_within_95), 0),
            number(summary.converged_after_s, 1),
            number(summary.wrongly_converged.map(|share| 100.0 * share), 1),
            number(Some(summary.updates_per_second), 0),
        ]);
    }
    let right = summaries.iter().filter(|summary| !summary.is_lost()).count();
    let referred = summaries.iter().any(|summary| summary.localizer.is_some());
    let verdict =
        if referred { format!("\nright at the end: {right} of {}", summaries.len()) } else { String::new() };
    format!("{}, {} scans\n{table}{verdict}", summaries[0].log, summaries[0].scans)
}

fn number(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
}
