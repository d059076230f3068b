//! `curionav localize`: the localiser on a log of a robot.

mod drive;
mod fit;
mod least_squares;
mod summary;

use std::path::{Path, PathBuf};

use clap::Args;
use curionav_deployment::files;
use curionav_picture::{Track as DrawnTrack, tracks_svg};
use curionav_planning::geometry::Pose2;
use curionav_planning::occupancy::StaticMap;
use curionav_runtime::convert;
use curionav_runtime::exit::{Exit, FAILED, SUCCESS};
use curionav_runtime::print::print;
use indicatif::{ProgressBar, ProgressStyle};

use crate::robot_log::drive_arguments::Given;
use crate::robot_log::{DriveArguments, Log, RecordingReader};
use drive::{Drive, Track, by_odometry};
use fit::Fitted;
use summary::Summary;

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
    #[command(flatten)]
    drive: DriveArguments,
    /// Fit noise of odometry and delay of the laser to the log, and write them into this file (.toml).
    #[arg(long, value_name = "FILE")]
    fit: Option<PathBuf>,
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

/// Drives the log, writes the picture, prints the figures, and gives the exit status.
///
/// # Errors
/// Bad input if log, recording, map or parameters cannot be used; failed if the picture cannot be written.
pub fn localize(options: &Options, reader: &RecordingReader) -> Result<u8, Exit> {
    let drive = read(options, reader).map_err(Exit::bad_input)?;
    if let Some(file) = &options.fit {
        return fit(&drive, options.drive.seed, file);
    }
    let count = drive.log.readings.len() as u64;
    let style =
        ProgressStyle::with_template("{bar:40} {percent} % {elapsed} left {eta}").map_err(Exit::failed)?;
    let bar = ProgressBar::new(count * u64::from(options.seeds)).with_style(style);
    let mut summaries = Vec::new();
    for nth in 0..u64::from(options.seeds) {
        let seed = options.drive.seed.saturating_add(nth);
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
    let arguments = &options.drive;
    let Given { log, delay_s, references_are, map, start, params, noise } = arguments.read(reader)?;
    Ok(Drive {
        log_name: arguments.path.display().to_string(),
        map_name: arguments.map.as_ref().map(|map| map.display().to_string()),
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
