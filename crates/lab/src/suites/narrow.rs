//! Doors and aisles by width, empty and with people.

use curionav_crowdsim::scenario::{Crowd, Motion};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::sensor::LaserModel;

use super::files::{File, map_files, rectangle, region, scenario_file, walking};
use crate::paper::{Layout, Polygon, task};

const FOLDER: &str = "narrow";
/// Widths of the narrow place, centimetres: the robot is 60 cm wide.
const WIDTHS_CM: [u32; 4] = [70, 80, 90, 100];
/// Side of a cell, metres: that of most maps of real buildings.
const CELL_M: f64 = 0.05;
/// Crowds are drawn where the robot gets by whole cells, and narrower places are narrower than that.
const PASSABLE_CM: u32 = 80;
/// Range of the laser, metres: a common one of a service robot.
const RANGE_M: f64 = 8.0;
/// Size of the floor, metres.
const WIDTH: f64 = 12.0;
const DEPTH: f64 = 8.0;

/// A narrow place.
struct Place {
    name: &'static str,
    description: &'static str,
    /// What makes it narrow, for a width in metres.
    furniture: fn(f64) -> Vec<Polygon>,
}

const PLACES: [Place; 4] = [
    Place { name: "door", description: "Through a door", furniture: door },
    Place { name: "aisle", description: "Through an aisle 4 m long", furniture: aisle },
    Place {
        name: "lobby",
        description: "Through two doors 2 m apart that are not in line",
        furniture: lobby,
    },
    Place { name: "bend", description: "Through a passage that turns twice", furniture: bend },
];

/// A wall across the floor from `west`, `thick` metres thick, with a gap whose middle is at `middle`.
fn wall(west: f64, thick: f64, middle: f64, gap: f64) -> Vec<Polygon> {
    let east = west + thick;
    vec![
        rectangle(west, -1.0, east, middle - 0.5 * gap),
        rectangle(west, middle + 0.5 * gap, east, DEPTH + 1.0),
    ]
}

fn door(width: f64) -> Vec<Polygon> {
    wall(6.0, 0.2, 4.0, width)
}

fn aisle(width: f64) -> Vec<Polygon> {
    wall(4.0, 4.0, 4.0, width)
}

fn lobby(width: f64) -> Vec<Polygon> {
    [wall(5.0, 0.2, 3.0, width), wall(7.2, 0.2, 5.0, width)].concat()
}

/// Into a block from the west, north inside it, and out to the east.
fn bend(width: f64) -> Vec<Polygon> {
    let half = 0.5 * width;
    vec![
        rectangle(4.0, -1.0, 8.0, 3.0 - half),
        rectangle(4.0, 3.0 + half, 6.0 - half, DEPTH + 1.0),
        rectangle(6.0 + half, 3.0 - half, 8.0, 5.0 - half),
        rectangle(6.0 - half, 5.0 + half, 8.0, DEPTH + 1.0),
    ]
}

pub(super) fn files() -> anyhow::Result<Vec<File>> {
    let mut files = Vec::new();
    for place in PLACES {
        for cm in WIDTHS_CM {
            files.extend(of_width(&place, cm)?);
        }
    }
    Ok(files)
}

fn of_width(place: &Place, cm: u32) -> anyhow::Result<Vec<File>> {
    let name = format!("{}-{cm}", place.name);
    let layout = Layout {
        outline: rectangle(0.0, 0.0, WIDTH, DEPTH),
        masonry: vec![rectangle(-1.0, -1.0, WIDTH + 1.0, DEPTH + 1.0)],
        furniture: (place.furniture)(f64::from(cm) / 100.0),
    };
    let mut files = map_files(FOLDER, &name, &layout.grid(CELL_M, None)?)?.to_vec();
    let map = format!("maps/{name}.yaml");
    let description = format!("{} {cm} cm wide.", place.description);
    let mut scenario = task(&name, &description, &map, Pose2::new(1.5, 4.0, 0.0), Point2::new(10.5, 4.0));
    scenario.laser = LaserModel { range_max: RANGE_M, ..LaserModel::default() };
    scenario.clock.time_limit_s = 90.0;
    files.push(scenario_file(FOLDER, &scenario)?);
    scenario.name += "-people";
    scenario.description = format!("{} {cm} cm wide, with people.", place.description);
    scenario.people.motion = Motion::Hrvo;
    // Before the narrow place two walk side by side; behind it, or before it too, two walk alone.
    let alone = if cm < PASSABLE_CM { across(2.0, 3.4) } else { across(8.6, 10.0) };
    scenario.crowds = vec![Crowd { group: [2, 2], ..across(2.0, 3.4) }, alone];
    files.push(scenario_file(FOLDER, &scenario)?);
    Ok(files)
}

/// Two people who walk to and fro across the robot's way, between `west` and `east`, metres.
fn across(west: f64, east: f64) -> Crowd {
    let regions = vec![region(west, 0.5, east, 2.5), region(west, 5.5, east, DEPTH - 0.5)];
    Crowd { regions, stretch_m: [3.0, 7.5], pause_s: [1.0, 1.0], ..walking(2) }
}
