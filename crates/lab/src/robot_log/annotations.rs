//! Where people are known to be at some scans of a log: a table that an annotator has made.

use std::collections::BTreeMap;
use std::path::Path;

use anyhow::{Context, bail, ensure};
use curionav_deployment::files;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::sensor::LaserModel;

use super::Log;

/// An annotation is of the scan that is nearest in time, if that is within so many seconds.
const NEAR_S: f64 = 0.05;
/// Farther from the origin than this no map reaches, metres.
const FARTHEST_M: f64 = 1e6;

/// What the positions of annotations are given in.
#[derive(Debug, Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Frame {
    /// The map's.
    Map,
    /// The robot's: x ahead, y to its left.
    Robot,
    /// The laser's: x along the middle of its view, y to the left.
    Laser,
}

impl Frame {
    /// A place in this frame in that of the robot, whose pose on the map is `robot`.
    pub(crate) fn in_robot(self, place: Point2, robot: Option<Pose2>, laser: &LaserModel) -> Point2 {
        match self {
            // Without a pose there is no better answer; no person is tracked there.
            Self::Map => robot.map_or(place, |robot| robot.inverse_transform(place)),
            Self::Robot => place,
            Self::Laser => laser.robot_from_laser.transform(place),
        }
    }
}

/// One line of the table.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Annotation {
    /// Seconds on the log's clock.
    stamp: f64,
    /// Where a person is, metres; nothing if the line says that no person is there.
    place: Option<Point2>,
}

/// Annotations by the number of their scan.
#[derive(Debug, Default, PartialEq)]
pub(crate) struct Annotated {
    /// A scan without people has an entry without places.
    pub(crate) scans: BTreeMap<usize, Vec<Point2>>,
    /// Lines that are of no scan.
    pub(crate) of_no_scan: usize,
}

/// Which column has what.
struct Columns {
    stamp: usize,
    x: usize,
    y: usize,
}

/// Reads a table and finds the scan of each line.
///
/// # Errors
/// The file cannot be read, a line of it cannot, or none is of the time of a scan. The error names file and line.
pub(crate) fn read(path: &Path, log: &Log) -> anyhow::Result<Annotated> {
    let text = files::text(path)?;
    let annotations = parse(&text).with_context(|| path.display().to_string())?;
    let annotated = by_scan(&annotations, log);
    if annotated.scans.is_empty() {
        bail!(
            "{}: no line is within {NEAR_S} s of a scan; its stamps are {} and those of the log {}: are they of the \
             same drive?",
            path.display(),
            span(annotations.iter().map(|one| one.stamp)),
            span(log.readings.iter().map(|reading| reading.stamp)),
        );
    }
    Ok(annotated)
}

/// From the least to the greatest.
fn span(stamps: impl Iterator<Item = f64> + Clone) -> String {
    let least = stamps.clone().fold(f64::INFINITY, f64::min);
    let greatest = stamps.fold(f64::NEG_INFINITY, f64::max);
    format!("{least:.3} to {greatest:.3} s")
}

fn parse(text: &str) -> anyhow::Result<Vec<Annotation>> {
    let mut lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let (_, header) = lines.next().context("it is empty: begin with the line stamp_s,x,y")?;
    let columns = Columns::of(header).context("line 1")?;
    let mut annotations = Vec::new();
    for (number, line) in lines {
        annotations.push(columns.annotation(line).with_context(|| format!("line {}", number + 1))?);
    }
    ensure!(!annotations.is_empty(), "it has no line below its header");
    Ok(annotations)
}

fn column(names: &[&str], wanted: &str) -> anyhow::Result<usize> {
    let found = names.iter().position(|name| *name == wanted);
    found.with_context(|| format!("it has no column `{wanted}`: begin with the line stamp_s,x,y"))
}

impl Columns {
    fn of(header: &str) -> anyhow::Result<Self> {
        let names: Vec<&str> = header.split(',').map(str::trim).collect();
        Ok(Self { stamp: column(&names, "stamp_s")?, x: column(&names, "x")?, y: column(&names, "y")? })
    }

    fn annotation(&self, line: &str) -> anyhow::Result<Annotation> {
        let cells: Vec<&str> = line.split(',').map(str::trim).collect();
        let stamp = number(&cells, self.stamp, "stamp_s", "seconds, such as 1403024492.410")?;
        if [self.x, self.y].iter().all(|at| cells.get(*at).is_some_and(|cell| cell.is_empty())) {
            return Ok(Annotation { stamp, place: None });
        }
        let x = number(&cells, self.x, "x", "metres, such as 1.25")?;
        let y = number(&cells, self.y, "y", "metres, such as 1.25")?;
        for (name, value) in [("x", x), ("y", y)] {
            ensure!(value.abs() <= FARTHEST_M, "{name} is {value} m: write at most {FARTHEST_M} m");
        }
        Ok(Annotation { stamp, place: Some(Point2::new(x, y)) })
    }
}

fn number(cells: &[&str], at: usize, name: &str, wanted: &str) -> anyhow::Result<f64> {
    let cell = cells.get(at).with_context(|| format!("it ends before {name}: write {wanted}"))?;
    let number: Option<f64> = cell.parse().ok().filter(|number: &f64| number.is_finite());
    number.with_context(|| format!("{name} is `{cell:.40}`: write {wanted}"))
}

fn by_scan(annotations: &[Annotation], log: &Log) -> Annotated {
    let mut annotated = Annotated::default();
    for one in annotations {
        match log.nearest(one.stamp, NEAR_S) {
            Some(scan) => annotated.scans.entry(scan).or_default().extend(one.place),
            None => annotated.of_no_scan += 1,
        }
    }
    annotated
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot_log::{Faults, Reading};

    fn log() -> Log {
        let reading = |k: i32| Reading {
            stamp: 100.0 + 0.1 * f64::from(k),
            ranges: vec![1.0; 3],
            laser: LaserModel::default(),
            odometry: Pose2::default(),
            reference: None,
        };
        Log::of((0..10).map(reading).collect(), Faults::default())
    }

    fn problem(text: &str) -> String {
        format!("{:#}", parse(text).unwrap_err())
    }

    #[test]
    fn each_line_is_of_the_scan_nearest_in_time_and_an_empty_place_says_that_nobody_is_there() {
        let text = "id, y, x, stamp_s\n7, 2, 1.5, 100.21\n8, 3, 1, 100.19\n\n,,,100.5\n9,0,0,250\n";
        let annotated = by_scan(&parse(text).unwrap(), &log());
        let expected = BTreeMap::from([(2, vec![Point2::new(1.5, 2.0), Point2::new(1.0, 3.0)]), (5, vec![])]);
        assert_eq!(annotated, Annotated { scans: expected, of_no_scan: 1 });
    }

    #[test]
    fn a_bad_line_is_named_with_what_to_write() {
        assert_eq!(
            problem("stamp_s,x,y\n1,2,3\n1,2,left\n"),
            "line 3: y is `left`: write metres, such as 1.25"
        );
        assert_eq!(problem("stamp_s,x,y\n1,2\n"), "line 2: it ends before y: write metres, such as 1.25");
        assert_eq!(problem("stamp_s,x,y\n1,,3\n"), "line 2: x is ``: write metres, such as 1.25");
        assert!(problem("stamp_s,x,y\nnan,2,3\n").starts_with("line 2: stamp_s is `nan`: write seconds"));
        assert!(problem("stamp_s,x,y\n1,2e7,3\n").starts_with("line 2: x is 20000000 m"));
        let header = "line 1: it has no column `stamp_s`: begin with the line stamp_s,x,y";
        assert_eq!(problem("time,x,y\n1,2,3\n"), header);
        assert!(problem("").contains("it is empty"));
        assert!(problem("stamp_s,x,y\n").contains("no line below its header"));
    }

    #[test]
    fn a_table_of_another_drive_is_refused_with_both_times() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("people.csv");
        std::fs::write(&path, "stamp_s,x,y\n7,1,1\n").unwrap();
        let error = format!("{:#}", read(&path, &log()).unwrap_err());
        assert!(error.contains("people.csv: no line is within 0.05 s of a scan"), "{error}");
        assert!(error.contains("7.000 to 7.000 s and those of the log 100.000 to 100.900 s"), "{error}");
    }
}
