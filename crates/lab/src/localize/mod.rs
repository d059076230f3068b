//! `curionav localize`: the localiser on a log of a robot.

mod drive;

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use comfy_table::Table;
use curionav_deployment::files::{self, MapFiles};
use curionav_localization::LocalizerParams;
use curionav_picture::{Track as DrawnTrack, tracks_svg};
use curionav_planning::geometry::Pose2;
use curionav_planning::motion::OdometryNoise;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::parameters;
use curionav_runtime::convert;
use curionav_runtime::exit::{Exit, FAILED, SUCCESS};
use curionav_runtime::print::print;
use indicatif::{ProgressBar, ProgressStyle};
use serde::Serialize;

use crate::robot_log::arguments::{LogFiles, pose, range_max, within};
use crate::robot_log::carmen::Scanner;
use crate::robot_log::{Faults, Log, Recorded, recorded};
use drive::{Consistency, Errors, Filter, Start, Track, by_odometry};

/// What every MCAP file begins with.
const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";
/// Farther off than this at the end, the robot is lost, metres.
const LOST_M: f64 = 1.0;

/// Run the localiser on a log of a robot with a planar laser, and say how well it does.
///
/// The log is one of the Carmen toolkit, as most published recordings are: lines ODOM, FLASER and ROBOTLASER1. Where it
/// gives poses beside odometry, such as those of a map builder, they are the references that errors are measured
/// against; --reference takes them from another log of the same scans. The map has to be in the same frame.
/// Or it is a recording of `curionav record` (.mcap), which has the map; its references are where the robot truly was
/// if it was simulated, and else where it believed it was.
///
///   curionav localize --map intel.yaml intel.log --reference intel.corrected.log
///   curionav localize --map intel.yaml intel.log --global
///   curionav localize monday.mcap --robot porter-3
///
/// Odometry is composed from its increments, so a log whose odometry begins anew goes on. Broken lines, gaps and clocks
/// that were set back are counted and mended or left out.
///
/// Exit status: 0 done, and at the end within 1 m of the last reference if there is one; 1 lost; 2 bad input.
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub struct Options {
    /// The log, or the recording.
    #[arg(value_name = "LOG")]
    path: PathBuf,
    /// The map: a map_server YAML file. Default: that of the recording.
    #[arg(long, value_name = "MAP.yaml")]
    map: Option<PathBuf>,
    /// The robot, if the recording has several.
    #[arg(long, value_name = "NAME")]
    robot: Option<String>,
    /// Another log of the same scans, whose poses are the references.
    #[arg(long, value_name = "LOG")]
    reference: Option<PathBuf>,
    /// Where the robot starts on the map, metres and radians. Default: where the first reference is.
    #[arg(long, value_name = "X,Y,HEADING", value_parser = pose, allow_hyphen_values = true, conflicts_with = "global")]
    start: Option<Pose2>,
    /// Start anywhere on the map.
    #[arg(long)]
    global: bool,
    /// Where the laser sits on the robot, metres and radians. Default: as the log says, else in the robot's centre.
    #[arg(long, value_name = "X,Y,HEADING", value_parser = pose, allow_hyphen_values = true)]
    laser: Option<Pose2>,
    /// Ranges from here on met nothing, metres.
    #[arg(long, value_name = "M", default_value_t = 30.0, value_parser = range_max)]
    range_max: f64,
    /// How many times greater than the simulated robot's the variances of odometry are. Five fits the bases of most
    /// published logs.
    #[arg(long, value_name = "N", default_value_t = 5.0, value_parser = odometry_noise)]
    odometry_noise: f64,
    /// Parameters of the localiser (.toml), as in the table `localizer` of a scenario.
    #[arg(long, value_name = "FILE")]
    localizer: Option<PathBuf>,
    /// Seed of the particles.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Where the picture of the tracks goes (.svg).
    #[arg(long, value_name = "FILE", default_value = "out/localize.svg")]
    out: PathBuf,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

fn odometry_noise(text: &str) -> Result<f64, String> {
    within(text, 0.0, 10_000.0)
}

/// What is printed.
#[derive(Debug, Serialize)]
struct Summary {
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
    /// From when it first had converged; of the whole log if it never had.
    localizer: Option<Errors>,
    odometry_alone: Option<Errors>,
    consistency: Option<Consistency>,
    updates: usize,
    updates_per_second: f64,
    seconds_per_second: f64,
    picture: String,
}

/// Reads what a recording holds of the robot of that name, or of its only one.
pub type RecordingReader = dyn Fn(&Path, Option<&str>) -> anyhow::Result<Recorded>;

/// Drives the log, writes the picture, prints the figures, and gives the exit status.
///
/// # Errors
/// Bad input if log, recording, map or parameters cannot be used; failed if the picture cannot be written.
pub fn localize(options: &Options, reader: &RecordingReader) -> Result<u8, Exit> {
    let (log, references_are, map, filter) = read(options, reader).map_err(Exit::bad_input)?;
    let references = log.readings.iter().filter(|reading| reading.reference.is_some()).count();
    let start = match (options.start, log.readings.iter().find_map(|reading| reading.reference)) {
        _ if options.global => Start::Anywhere,
        (Some(pose), _) | (None, Some(pose)) => Start::At(pose),
        (None, None) => {
            let problem = "the log has no poses beside odometry: give --start, --global or --reference";
            return Err(Exit::bad_input(anyhow::anyhow!("{}: {problem}", options.path.display())));
        }
    };
    let style =
        ProgressStyle::with_template("{bar:40} {percent} % {elapsed} left {eta}").map_err(Exit::failed)?;
    let bar = ProgressBar::new(log.readings.len() as u64).with_style(style);
    let track = Track::of(&log, &map, start, filter, |done| bar.set_position(done as u64));
    bar.finish_and_clear();
    let track = track.map_err(Exit::bad_input)?;
    let alone = by_odometry(&log, &track);
    files::write(&options.out, picture(&map, &log, &track, &alone)).map_err(Exit::failed)?;

    let first = track.converged.iter().position(|is| *is);
    let from = first.unwrap_or(0);
    let with_reference = |poses: &[Pose2]| -> Vec<(Pose2, Pose2)> {
        let pairs = poses.iter().zip(&log.readings).skip(from);
        pairs.filter_map(|(pose, reading)| Some((*pose, reading.reference?))).collect()
    };
    let pairs = with_reference(&track.poses);
    let alone = with_reference(&alone);
    let covariances = track.covariances.iter().zip(&log.readings).skip(from);
    let covariances: Vec<_> = covariances
        .filter(|(_, reading)| reading.reference.is_some())
        .map(|(covariance, _)| *covariance)
        .collect();
    let losses = track.converged.windows(2).filter(|pair| pair[0] && !pair[1]).count();
    let summary = Summary {
        log: options.path.display().to_string(),
        map: options.map.as_ref().map(|map| map.display().to_string()),
        scans: log.readings.len(),
        duration_s: log.duration(),
        length_m: log.length(),
        faults: log.faults.clone(),
        references,
        references_are,
        converged_after_s: first.map(|k| log.readings[k].stamp - log.readings[0].stamp),
        lost_convergence: losses,
        localizer: Errors::of(&pairs),
        odometry_alone: Errors::of(&alone),
        consistency: Consistency::of(&pairs, &covariances),
        updates: track.updates,
        updates_per_second: track.updates as f64 / track.wall_s.max(1e-9),
        seconds_per_second: log.duration() / track.wall_s.max(1e-9),
        picture: options.out.display().to_string(),
    };
    let json = serde_json::to_string(&summary).map_err(Exit::failed);
    print(if options.json { json? } else { words(&summary) })?;
    Ok(if summary.localizer.is_some_and(|errors| errors.at_end_m > LOST_M) { FAILED } else { SUCCESS })
}

fn read(options: &Options, reader: &RecordingReader) -> anyhow::Result<(Log, String, StaticMap, Filter)> {
    let scanner = Scanner { range_max: options.range_max, robot_from_laser: options.laser };
    let files = LogFiles { log: &options.path, reference: options.reference.as_deref(), scanner };
    let mut map = None;
    let mut references_are = "poses of the log".to_owned();
    let log = if files::begins_with(&options.path, MCAP_MAGIC)? {
        let recorded = reader(&options.path, options.robot.as_deref())?;
        let log = recorded::log(&recorded, scanner);
        let (mut log, what) = log.with_context(|| options.path.display().to_string())?;
        files.take_references(&mut log)?;
        (map, references_are) = (recorded.map, what.to_owned());
        log
    } else {
        files.read_carmen()?
    };
    if let Some(path) = &options.reference {
        references_are = format!("poses of {}", path.display());
    }
    let grid = match (&options.map, map) {
        (Some(path), _) => MapFiles::read(path)?.grid()?,
        (None, Some(map)) => convert::occupancy_grid(map)?,
        (None, None) => anyhow::bail!("{}: it has no map: give --map", options.path.display()),
    };
    let map = StaticMap::new(grid);
    let params = match &options.localizer {
        Some(path) => {
            let text = files::text(path)?;
            parameters::read::<LocalizerParams>(&text).with_context(|| path.display().to_string())?
        }
        None => LocalizerParams::default(),
    };
    let simulated = OdometryNoise::default();
    let noise = OdometryNoise {
        position_per_metre: options.odometry_noise * simulated.position_per_metre,
        position_per_radian: options.odometry_noise * simulated.position_per_radian,
        heading_per_metre: options.odometry_noise * simulated.heading_per_metre,
        heading_per_radian: options.odometry_noise * simulated.heading_per_radian,
    };
    Ok((log, references_are, map, Filter { params, noise, seed: options.seed }))
}

fn picture(map: &StaticMap, log: &Log, track: &Track, alone: &[Pose2]) -> String {
    let points = |poses: &[Pose2]| poses.iter().map(|pose| (pose.x, pose.y)).collect();
    let references: Vec<Pose2> = log.readings.iter().filter_map(|reading| reading.reference).collect();
    let tracks = [
        DrawnTrack { name: "odometry alone", colour: "#999999", points: points(alone) },
        DrawnTrack { name: "reference", colour: "#0072B2", points: points(&references) },
        DrawnTrack { name: "localiser", colour: "#D55E00", points: points(&track.poses) },
    ];
    tracks_svg(&convert::occupancy_grid_to_wire(&map.grid), &tracks)
}

fn words(summary: &Summary) -> String {
    let Summary { faults, .. } = summary;
    let mut lines = vec![format!(
        "{}: {} scans in {:.0} s, {:.0} m by odometry",
        summary.log, summary.scans, summary.duration_s, summary.length_m
    )];
    for (count, what) in [
        (faults.broken_lines, "lines that cannot be read"),
        (faults.disordered_scans, "scans that are no newer than the one before"),
        (faults.clock_set_back, "times at which the clock was set back"),
        (faults.gaps, "gaps of two seconds or longer"),
        (faults.odometry_restarts, "restarts of odometry"),
        (faults.later_runs, "later runs of the recording, which are left out"),
    ] {
        if count > 0 {
            let first = faults.first_broken.as_ref().filter(|_| what.starts_with("lines"));
            lines.push(format!(
                "  {count} {what}{}",
                first.map_or(String::new(), |first| format!(" ({first})"))
            ));
        }
    }
    if faults.without_clock {
        lines.push("  no stamps that tell when scans were taken: they count as one second apart".to_owned());
    }
    lines.push(match summary.converged_after_s {
        Some(after) => {
            format!("converged after {after:.1} s; convergence lost {} times", summary.lost_convergence)
        }
        None => "never converged".to_owned(),
    });
    if let (Some(filter), Some(alone)) = (summary.localizer, summary.odometry_alone) {
        let mut table = Table::new();
        table.load_style(comfy_table::presets::UTF8_BORDERS_ONLY);
        table.set_header(["error", "localiser", "odometry alone"]);
        for (what, of) in [
            ("median, m", (|e| e.median_m) as fn(Errors) -> f64),
            ("mean, m", |e| e.mean_m),
            ("95 % below, m", |e| e.p95_m),
            ("greatest, m", |e| e.greatest_m),
            ("at the end, m", |e| e.at_end_m),
            ("heading, median, degrees", |e| e.heading_median_deg),
        ] {
            table.add_row([what.to_owned(), format!("{:.2}", of(filter)), format!("{:.2}", of(alone))]);
        }
        lines
            .push(format!("against {} references, {}:\n{table}", summary.references, summary.references_are));
    }
    if let Some(Consistency { mean, share_within_95 }) = summary.consistency {
        lines.push(format!(
            "covariance: normalised squared error {mean:.1} on average (3 is honest), {:.0} % within the 95 % region",
            100.0 * share_within_95
        ));
    }
    lines.push(format!(
        "{} filter updates, {:.0} per second; {:.0} times as fast as it was driven",
        summary.updates, summary.updates_per_second, summary.seconds_per_second
    ));
    lines.push(format!("the tracks are in {}", summary.picture));
    lines.join("\n")
}

#[cfg(test)]
mod tests;
