//! `curionav track`: the tracker of people on a log of a robot.

mod follow;
mod positioning;
mod score;
mod summary;

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use curionav_deployment::files;
use curionav_picture::{Marks, Track as DrawnTrack, people_svg};
use curionav_planning::geometry::Point2;
use curionav_planning::parameters;
use curionav_runtime::convert;
use curionav_runtime::exit::{Exit, FAILED, SUCCESS};
use curionav_runtime::print::print;
use curionav_tracking_people::TrackerParams;
use indicatif::{ProgressBar, ProgressStyle};

use crate::robot_log::annotations::{self, Annotated, Frame};
use crate::robot_log::drive_arguments::Given;
use crate::robot_log::{DriveArguments, RecordingReader};
use follow::{Course, Drive};
use positioning::Way;
use score::{Judged, Judgement, Outcome};
use summary::{Names, Summary, people_table};

/// Run the tracker of people on a log of a robot with a planar laser, and say where it follows which people.
///
/// Log, recording, map and start are those of `curionav localize`. At each scan the localiser says where the robot is,
/// and the tracker who is around it, as the services do. --raw-odometry and --by-reference take the robot's place from
/// elsewhere.
///
/// With --annotations, a table of where people are known to be, it says how good that is: recall, precision and F1 of
/// people within 0.5 m, and OSPA with a cut of 1 m. Only annotated scans count, and only what is within view and range
/// of the laser. The table has a line per person and scan. A line without x and y says that a scan shows no
/// person. `python -m curionav.bags people` makes a table of a bag:
///
///   stamp_s,x,y
///   1403024492.411,4.76,-2.81
///   1403024493.211,,
///
///   curionav track lobby.log --map lobby.yaml --reference lobby.reference.log
///   curionav track lobby.log --map lobby.yaml --global --annotations people.csv --annotations-frame robot
///   curionav track monday.mcap --robot porter-3 --people out/people.csv
///
/// Exit status: 0 done, and at the end within 1 m of the last reference if there is one; 1 lost; 2 bad input.
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub struct Options {
    #[command(flatten)]
    drive: DriveArguments,
    /// The robot is where odometry says, from its start on: no localisation.
    #[arg(long, conflicts_with_all = ["global", "by_reference"])]
    raw_odometry: bool,
    /// The robot is where the references say: no localisation. Scans without a reference are left out.
    #[arg(long, conflicts_with = "global")]
    by_reference: bool,
    /// Parameters of the tracker (.toml), as in the table `tracker` of a scenario.
    #[arg(long, value_name = "FILE")]
    tracker: Option<PathBuf>,
    /// Where people are known to be (.csv): columns stamp_s, x and y, seconds and metres. Others are ignored.
    #[arg(long, value_name = "FILE")]
    annotations: Option<PathBuf>,
    /// The frame of x and y in the annotations.
    #[arg(long, value_name = "FRAME", default_value = "map", requires = "annotations")]
    annotations_frame: Frame,
    /// Where a table of the people at each scan goes (.csv), with the columns of annotations and more.
    #[arg(long, value_name = "FILE")]
    people: Option<PathBuf>,
    /// Where the picture goes (.svg): map, way of the robot, tracks of people and annotations.
    #[arg(long, value_name = "FILE", default_value = "out/track.svg")]
    out: PathBuf,
    /// Print one JSON object on standard output.
    #[arg(long)]
    json: bool,
}

/// Drives the log, writes the picture, prints the figures, and gives the exit status.
///
/// # Errors
/// Bad input if log, recording, map, parameters or annotations cannot be used; failed if a file cannot be written.
pub fn track(options: &Options, reader: &RecordingReader) -> Result<u8, Exit> {
    let drive = read(options, reader).map_err(Exit::bad_input)?;
    let annotated = annotated(options, &drive).map_err(Exit::bad_input)?;
    let style =
        ProgressStyle::with_template("{bar:40} {percent} % {elapsed} left {eta}").map_err(Exit::failed)?;
    let bar = ProgressBar::new(drive.given.log.readings.len() as u64).with_style(style);
    let course = Course::of(&drive, |done| bar.set_position(done as u64));
    bar.finish_and_clear();
    let course = course.map_err(Exit::bad_input)?;
    let judgement =
        annotated.as_ref().map(|annotated| Judgement::of(&course, annotated, options.annotations_frame));
    let marks = judgement.as_ref().map_or(&[][..], |judgement| &judgement.judged);
    files::write(&options.out, picture(&drive.given, &course, marks)).map_err(Exit::failed)?;
    if let Some(path) = &options.people {
        files::write(path, people_table(&course)).map_err(Exit::failed)?;
    }
    let score = judgement.as_ref().map(Judgement::score);
    let summary = Summary::of(names(options), &drive, &course, score);
    print(if options.json {
        serde_json::to_string(&summary).map_err(Exit::failed)?
    } else {
        summary.words()
    })?;
    Ok(if summary.is_lost() { FAILED } else { SUCCESS })
}

fn names(options: &Options) -> Names {
    Names {
        log: options.drive.path.display().to_string(),
        map: options.drive.map.as_ref().map(|map| map.display().to_string()),
        people: options.people.as_ref().map(|path| path.display().to_string()),
        picture: options.out.display().to_string(),
    }
}

fn read(options: &Options, reader: &RecordingReader) -> anyhow::Result<Drive> {
    let arguments = &options.drive;
    let way = match (options.raw_odometry, options.by_reference) {
        (true, _) => Way::Odometry,
        (false, true) => Way::References,
        (false, false) => Way::Localizer,
    };
    let given = arguments.read(reader)?;
    if way == Way::References && given.log.readings.iter().all(|reading| reading.reference.is_none()) {
        anyhow::bail!("{}: --by-reference needs references: give --reference", arguments.path.display());
    }
    Ok(Drive { given, way, params: tracker_params(options)?, seed: arguments.seed })
}

fn annotated(options: &Options, drive: &Drive) -> anyhow::Result<Option<Annotated>> {
    let Some(path) = &options.annotations else { return Ok(None) };
    Ok(Some(annotations::read(path, &drive.given.log)?))
}

fn tracker_params(options: &Options) -> anyhow::Result<TrackerParams> {
    let Some(path) = &options.tracker else { return Ok(TrackerParams::default()) };
    let text = files::text(path)?;
    parameters::read::<TrackerParams>(&text).with_context(|| path.display().to_string())
}

fn picture(given: &Given, course: &Course, judged: &[Judged]) -> String {
    let way = course.scans.iter().filter_map(|scanned| scanned.pose);
    let way =
        DrawnTrack { name: "robot", colour: "#0072B2", points: way.map(|pose| (pose.x, pose.y)).collect() };
    let marks = [
        marks(judged, Outcome::Found, "annotated, found", "#009E73"),
        marks(judged, Outcome::Missed, "annotated, missed", "#D55E00"),
        marks(judged, Outcome::FalsePositive, "tracked, not annotated", "#E69F00"),
    ];
    people_svg(&convert::occupancy_grid_to_wire(&given.map.grid), &way, &tracks(course), &marks)
}

fn marks(judged: &[Judged], outcome: Outcome, name: &'static str, colour: &'static str) -> Marks<'static> {
    let places = judged.iter().filter(|one| one.outcome == outcome).map(|one| one.place);
    Marks { name, colour, points: places.map(|Point2 { x, y }| (x, y)).collect() }
}

/// The way of each person on the map.
fn tracks(course: &Course) -> Vec<Vec<(f64, f64)>> {
    let mut tracks: std::collections::BTreeMap<u32, Vec<(f64, f64)>> = std::collections::BTreeMap::new();
    for scanned in &course.scans {
        for person in scanned.people.iter().filter(|person| person.age == 0.0) {
            let place = scanned.on_map(person.position);
            tracks.entry(person.id).or_default().extend(place.map(|Point2 { x, y }| (x, y)));
        }
    }
    tracks.into_values().collect()
}

#[cfg(test)]
mod tests;
