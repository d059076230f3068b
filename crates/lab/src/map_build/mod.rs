//! `curionav map build`: a map from the scans of a log whose poses are known.

mod evidence;

use std::path::PathBuf;

use anyhow::Context;
use clap::Args;
use curionav_deployment::files;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::{Cell, MapYaml, OccupancyGrid, encode_pgm};
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::print::print;

use crate::robot_log::Log;
use crate::robot_log::annotations::{self, Annotated, Frame};
use crate::robot_log::arguments::{LogFiles, pose, range_max, within};
use crate::robot_log::carmen::Scanner;
use evidence::Evidence;

/// Around an annotated person so much becomes free, metres: what a stride and the click of an annotator are off.
const PERSON_M: f64 = 0.4;

/// Build a map from a log of a robot with a planar laser, whose poses are known.
///
/// The poses are those that the log gives beside odometry, such as those of GMapping, or those of --reference, another
/// log of the same scans. Cells that beams pass become free, and those in which beams end become occupied. The map is
/// one that map_server reads: a YAML file, and beside it an image (.pgm).
///
///   curionav map build intel.log --reference intel.corrected.log --out intel.yaml
///   curionav map build aces.log --every 2 --out aces-even.yaml    # the other scans can test `localize`
///   curionav map build lobby.log --annotations people.csv --annotations-frame robot    # a map to test `track` on
///
/// Who stands while a map is made becomes a part of it, and no tracker finds them there. With --annotations, a table as
/// `curionav track` takes it, the places of these people are free.
///
/// Exit status: 0 done; 2 bad input.
#[derive(Debug, Args)]
#[command(verbatim_doc_comment)]
pub struct Options {
    /// The log: of the Carmen toolkit or of GMapping.
    #[arg(value_name = "LOG")]
    path: PathBuf,
    /// Another log of the same scans, whose poses are the references.
    #[arg(long, value_name = "LOG")]
    reference: Option<PathBuf>,
    /// Take every n-th scan.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..))]
    every: u32,
    /// Side of a cell, metres.
    #[arg(long, value_name = "M", default_value_t = 0.05, value_parser = resolution)]
    resolution: f64,
    /// Where the laser sits on the robot, metres and radians. Default: as the log says, else in the robot's centre.
    #[arg(long, value_name = "X,Y,HEADING", value_parser = pose, allow_hyphen_values = true)]
    laser: Option<Pose2>,
    /// Ranges from here on met nothing, metres.
    #[arg(long, value_name = "M", default_value_t = 30.0, value_parser = range_max)]
    range_max: f64,
    /// Where people are known to be (.csv), who are left out: columns stamp_s, x and y, seconds and metres.
    #[arg(long, value_name = "FILE")]
    annotations: Option<PathBuf>,
    /// The frame of x and y in the annotations.
    #[arg(long, value_name = "FRAME", default_value = "map", requires = "annotations")]
    annotations_frame: Frame,
    /// Where the map goes (.yaml).
    #[arg(long, value_name = "FILE", default_value = "out/map.yaml")]
    out: PathBuf,
}

fn resolution(text: &str) -> Result<f64, String> {
    within(text, 0.01, 1.0)
}

/// Reads the log, builds the map and writes it.
///
/// # Errors
/// Bad input if the log cannot be used or has no poses, or if the map would be too large; failed if it cannot be
/// written.
pub fn build(options: &Options) -> Result<u8, Exit> {
    let scanner = Scanner { range_max: options.range_max, robot_from_laser: options.laser };
    let files = LogFiles { log: &options.path, reference: options.reference.as_deref(), scanner };
    let log = files.read_carmen().map_err(Exit::bad_input)?;
    let mut evidence = Evidence::default();
    let mut scans = 0;
    for reading in log.readings.iter().step_by(options.every as usize) {
        if let Some(reference) = reading.reference {
            evidence.add(reading, reference, options.resolution);
            scans += 1;
        }
    }
    if let Some(path) = &options.annotations {
        let annotated = annotations::read(path, &log).map_err(Exit::bad_input)?;
        for place in places(&log, &annotated, options.annotations_frame) {
            evidence.clear(place, PERSON_M, options.resolution);
        }
    }
    let grid = evidence.grid(options.resolution);
    let grid = grid.with_context(|| options.path.display().to_string()).map_err(Exit::bad_input)?;
    write(options, &grid).map_err(Exit::failed)?;
    print(summary(options, &grid, scans))?;
    Ok(SUCCESS)
}

/// Where the annotated people are on the map. Those of a scan without a pose are left out.
fn places(log: &Log, annotated: &Annotated, frame: Frame) -> Vec<Point2> {
    let mut on_map = Vec::new();
    for (scan, places) in &annotated.scans {
        let reading = &log.readings[*scan];
        let Some(robot) = reading.reference else { continue };
        let in_robot = places.iter().map(|place| frame.in_robot(*place, Some(robot), &reading.laser));
        on_map.extend(in_robot.map(|place| robot.transform(place)));
    }
    on_map
}

/// The YAML file, and the image beside it.
fn write(options: &Options, grid: &OccupancyGrid) -> anyhow::Result<()> {
    let image = options.out.with_extension("pgm");
    let name = image.file_name().context("--out names no file")?.to_string_lossy().into_owned();
    files::write(&image, encode_pgm(grid))?;
    files::write(&options.out, MapYaml::trinary(grid, &name).to_text()?)
}

fn summary(options: &Options, grid: &OccupancyGrid, scans: usize) -> String {
    let cell = options.resolution;
    let width = grid.width() as f64 * cell;
    let height = grid.height() as f64 * cell;
    let free = (0..grid.cells().len()).filter(|index| grid.cell(*index) == Cell::Free).count();
    let area = free as f64 * cell * cell;
    let path = options.out.display();
    format!("{path}: {width:.1} m x {height:.1} m, {area:.0} m2 of it free, from {scans} scans")
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use curionav_deployment::files::MapFiles;

    /// A robot in the middle of a room of 4 m x 4 m sees its walls all around, over and over.
    fn room(folder: &Path) -> PathBuf {
        let range = |beam: i32| {
            let bearing = (f64::from(beam) - 90.0).to_radians();
            2.0 / bearing.cos().abs().max(bearing.sin().abs())
        };
        let ranges: Vec<String> = (0..181).map(|beam| format!("{:.3}", range(beam))).collect();
        let scan = |k: i32| {
            let heading = f64::from(k) * std::f64::consts::FRAC_PI_2;
            format!("FLASER 181 {} 10 5 {heading} 0 0 0 {k} host {k}\n", ranges.join(" "))
        };
        let path = folder.join("room.log");
        std::fs::write(&path, (0..8).map(scan).collect::<String>()).unwrap();
        path
    }

    fn options(folder: &Path) -> Options {
        Options {
            path: room(folder),
            reference: None,
            every: 1,
            resolution: 0.1,
            laser: None,
            range_max: 30.0,
            annotations: None,
            annotations_frame: Frame::Map,
            out: folder.join("map.yaml"),
        }
    }

    #[test]
    fn who_is_annotated_while_the_map_is_made_is_no_part_of_it() {
        let folder = tempfile::tempdir().unwrap();
        let people = folder.path().join("people.csv");
        // Two metres ahead of the robot in the first scan, which is where a wall would be.
        std::fs::write(&people, "stamp_s,x,y\n0,2,0\n").unwrap();
        let options =
            Options { annotations: Some(people), annotations_frame: Frame::Robot, ..options(folder.path()) };
        assert_eq!(build(&options).unwrap(), SUCCESS);
        let grid = MapFiles::read(&options.out).unwrap().grid().unwrap();
        assert_eq!(grid.at(Point2::new(12.0, 5.0)), Cell::Free);
        assert_eq!(grid.at(Point2::new(12.05, 6.0)), Cell::Occupied);
    }

    #[test]
    fn a_room_has_its_walls_where_the_beams_ended_and_is_free_within() {
        let folder = tempfile::tempdir().unwrap();
        let options = options(folder.path());
        assert_eq!(build(&options).unwrap(), SUCCESS);
        let grid = MapFiles::read(&options.out).unwrap().grid().unwrap();
        for k in -18..=18 {
            let along = 0.1 * f64::from(k);
            for (x, y) in [(along, 2.0), (along, -2.0), (2.0, along), (-2.0, along)] {
                let near = [-0.1, 0.0, 0.1].iter().flat_map(|dx| [-0.1, 0.0, 0.1].map(|dy| (dx, dy)));
                let is_wall = near
                    .into_iter()
                    .any(|(dx, dy)| grid.at(Point2::new(10.0 + x + dx, 5.0 + y + dy)) == Cell::Occupied);
                assert!(is_wall, "{x} {y}");
            }
            let inside = Point2::new(10.0 + along * 0.9, 5.0 - along * 0.8);
            assert_eq!(grid.at(inside), Cell::Free, "{inside:?}");
        }
    }

    #[test]
    fn a_log_without_poses_and_a_map_that_is_too_large_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let far = options(folder.path());
        let text = std::fs::read_to_string(&far.path).unwrap();
        std::fs::write(&far.path, text.clone() + &text.replace(" 10 5 ", " 99999 5 ")).unwrap();
        let said = format!("{:?}", build(&Options { resolution: 0.01, ..far }).unwrap_err());
        assert!(said.contains("cells") && said.contains("--resolution"), "{said}");
        let standing = options(folder.path());
        let lines: String = text.lines().map(|line| line.replace(" 10 5 ", " 0 0 ") + "\n").collect();
        let still: String = lines.lines().take(1).map(|line| line.to_owned() + "\n").collect();
        std::fs::write(&standing.path, still).unwrap();
        let said = format!("{:?}", build(&standing).unwrap_err());
        assert!(said.contains("--reference"), "{said}");
    }
}
