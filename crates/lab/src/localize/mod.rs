//! `curionav localize`: the localiser on a log of a robot.

mod drive;
mod fit;
mod least_squares;
mod robot_file;
mod summary;

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use curionav_deployment::files::{self, MapFiles};
use curionav_localization::LocalizerParams;
use curionav_picture::{Track as DrawnTrack, tracks_svg};
use curionav_planning::geometry::Pose2;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::parameters;
use curionav_runtime::convert;
use curionav_runtime::exit::{Exit, FAILED, SUCCESS};
use curionav_runtime::print::print;
use indicatif::{ProgressBar, ProgressStyle};

use crate::robot_log::arguments::{LogFiles, pose, range_max, within};
use crate::robot_log::carmen::Scanner;
use crate::robot_log::{Log, Recorded, recorded};
use drive::{Drive, Start, Track, by_odometry};
use fit::Fitted;
use robot_file::RobotFile;
use summary::Summary;

/// What every MCAP file begins with.
const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Run the localiser on a log of a robot with a planar laser, and say how well it does.
///
/// The log is one of the Carmen toolkit, as most published recordings are: lines ODOM, FLASER and ROBOTLASER1. Where it
/// gives poses beside odometry, such as those of a map builder, they are the references that errors are measured
/// against; --reference takes them from another log of the same scans. The map has to be in the same frame.
/// Or it is a recording of `curionav record` (.mcap), which has the map; its references are where the robot truly was
/// if it was simulated, and else where it believed it was.
///
///   curionav localize --map intel.yaml intel.log --reference intel.corrected.log
///   curionav localize --map intel.yaml intel.log --global --seeds 5
///   curionav localize monday.mcap --robot porter-3
///   curionav localize --map intel.yaml intel.log --seconds 0,600 --fit r1.toml
///   curionav localize --map intel.yaml intel.log --seconds 600,2700 --robot-file r1.toml
///
/// Odometry is composed from its increments, so a log whose odometry begins anew goes on. Broken lines, gaps and clocks
/// that were set back are counted and mended or left out.
///
/// Exit status: 0 done, and at the end within 1 m of the last reference if there is one, with every seed; 1 lost; 2 bad
/// input.
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
    #[arg(long, value_name = "N", default_value_t = 5.0, value_parser = odometry_noise, conflicts_with = "robot_file")]
    odometry_noise: f64,
    /// How long before their stamps scans were taken, seconds.
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = laser_delay, conflicts_with = "robot_file")]
    laser_delay: f64,
    /// The robot's configuration, such as one that --fit wrote: noise of odometry and delay of the laser.
    #[arg(long, value_name = "FILE")]
    robot_file: Option<PathBuf>,
    /// Fit noise of odometry and delay of the laser to the log, and write them into this file (.toml).
    #[arg(long, value_name = "FILE")]
    fit: Option<PathBuf>,
    /// Only the part of the log between these times, seconds after its first scan.
    #[arg(long, value_name = "FROM,TO", value_parser = part)]
    seconds: Option<(f64, f64)>,
    /// Parameters of the localiser (.toml), as in the table `localizer` of a scenario.
    #[arg(long, value_name = "FILE")]
    localizer: Option<PathBuf>,
    /// Seed of the particles.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// Drive the log with so many seeds, from --seed on, and print a table.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000))]
    seeds: u32,
    /// Where the picture of the tracks goes (.svg): those of the first seed.
    #[arg(long, value_name = "FILE", default_value = "out/localize.svg")]
    out: PathBuf,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

fn laser_delay(text: &str) -> Result<f64, String> {
    within(text, 0.0, 1.0)
}

fn part(text: &str) -> Result<(f64, f64), String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[from, to]) if 0.0 <= from && from < to => Ok((from, to)),
        _ => Err("give two times with a comma between them, such as 0,300".into()),
    }
}

fn odometry_noise(text: &str) -> Result<f64, String> {
    within(text, 0.0, 10_000.0)
}

/// Reads what a recording holds of the robot of that name, or of its only one.
pub type RecordingReader = dyn Fn(&Path, Option<&str>) -> anyhow::Result<Recorded>;

/// Drives the log, writes the picture, prints the figures, and gives the exit status.
///
/// # Errors
/// Bad input if log, recording, map or parameters cannot be used; failed if the picture cannot be written.
pub fn localize(options: &Options, reader: &RecordingReader) -> Result<u8, Exit> {
    let drive = read(options, reader).map_err(Exit::bad_input)?;
    if let Some(file) = &options.fit {
        return fit(&drive, options.seed, file);
    }
    let count = drive.log.readings.len() as u64;
    let style =
        ProgressStyle::with_template("{bar:40} {percent} % {elapsed} left {eta}").map_err(Exit::failed)?;
    let bar = ProgressBar::new(count * u64::from(options.seeds)).with_style(style);
    let mut summaries = Vec::new();
    for nth in 0..u64::from(options.seeds) {
        let seed = options.seed.saturating_add(nth);
        let track = drive.track(seed, |done| bar.set_position(nth * count + done as u64));
        let track = track.map_err(Exit::bad_input)?;
        let alone = by_odometry(&drive.log, &track);
        if nth == 0 {
            let picture = picture(&drive.map, &drive.log, &track, &alone);
            files::write(&options.out, picture).map_err(Exit::failed)?;
        }
        summaries.push(Summary::of(&drive, seed, &track, &alone));
    }
    bar.finish_and_clear();
    let said = match (summaries.as_slice(), options.json) {
        ([one], true) => serde_json::to_string(one).map_err(Exit::failed)?,
        (several, true) => serde_json::to_string(several).map_err(Exit::failed)?,
        ([one], false) => one.words(),
        (several, false) => summary::table(several),
    };
    print(said)?;
    Ok(if summaries.iter().any(Summary::is_lost) { FAILED } else { SUCCESS })
}

/// Fits the log, writes what was found into `file`, and prints it.
fn fit(drive: &Drive, seed: u64, file: &Path) -> Result<u8, Exit> {
    let bar = ProgressBar::new_spinner();
    bar.set_message("fitting");
    let count = drive.log.readings.len();
    let fitted = Fitted::of(drive, seed, |done| {
        bar.set_message(format!(
            "fitting: drive {} of {}",
            done.saturating_sub(1) / count + 1,
            Fitted::DRIVES
        ));
        bar.tick();
    });
    let fitted = fitted.map_err(Exit::bad_input)?;
    bar.finish_and_clear();
    let said = fitted.toml(&drive.log_name);
    files::write(file, &said).map_err(Exit::failed)?;
    print(format_args!("{said}\nwritten to {}", file.display()))?;
    Ok(SUCCESS)
}

fn read(options: &Options, reader: &RecordingReader) -> anyhow::Result<Drive> {
    let scanner = Scanner { range_max: options.range_max, robot_from_laser: options.laser };
    let files = LogFiles { log: &options.path, reference: options.reference.as_deref(), scanner };
    let mut map = None;
    let mut references_are = "poses of the log".to_owned();
    let mut log = if files::begins_with(&options.path, MCAP_MAGIC)? {
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
    if let Some((from, to)) = options.seconds {
        log = log.part(from, to);
        anyhow::ensure!(!log.readings.is_empty(), "--seconds: the log has no scan between these times");
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
    let RobotFile { noise, delay_s } = match &options.robot_file {
        Some(path) => RobotFile::read(path)?,
        None => RobotFile::of_arguments(options.odometry_noise, options.laser_delay),
    };
    let start = match (options.start, log.readings.iter().find_map(|reading| reading.reference)) {
        _ if options.global => Start::Anywhere,
        (Some(pose), _) | (None, Some(pose)) => Start::At(pose),
        (None, None) => {
            let problem = "the log has no poses beside odometry: give --start, --global or --reference";
            anyhow::bail!("{}: {problem}", options.path.display());
        }
    };
    Ok(Drive {
        log_name: options.path.display().to_string(),
        map_name: options.map.as_ref().map(|map| map.display().to_string()),
        picture: options.out.display().to_string(),
        log,
        delay_s,
        references_are,
        map,
        start,
        params,
        noise,
    })
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

#[cfg(test)]
mod tests;
