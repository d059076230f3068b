//! Tasks drawn at random, on floor plans drawn at random and on published maps.

use std::path::Path;

use anyhow::{Context, ensure};
use curionav_crowdsim::Scenario;
use curionav_crowdsim::scenario::{Behaviour, Crowd, Motion};
use curionav_datasets::locate;
use curionav_deployment::files::MapFiles;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::{Cell, GeodesicField, StaticMap};
use curionav_planning::random::{Rng, rng, uniform};
use curionav_planning::sensor::LaserModel;

use super::files::{File, in_company, map_files, scenario_file, walking};
use super::floor_plan::Use;
use crate::paper::{rounded, task};

/// Floor plans of each use.
const PLANS: u64 = 6;
/// Side of a cell, metres.
const CELL_M: f64 = 0.1;
/// Tasks on each published map.
const TASKS: u64 = 4;
/// Random streams of floor plans and of tasks.
const STREAM: u64 = 0x524f_4f4d;
/// Range of the laser, metres: a common one of a service robot; in void halls it is shorter than the way.
const RANGE_M: f64 = 8.0;
/// Draws of a start and goal before a floor counts as too small.
const DRAWS: usize = 200;

/// Published maps, and the least and greatest length of a task there, metres.
const PUBLISHED: [(&str, &str, [f64; 2]); 4] = [
    ("depot", "maps_nav2_turtlebot/depot.yaml", [12.0, 30.0]),
    ("warehouse", "maps_nav2_turtlebot/warehouse.yaml", [15.0, 40.0]),
    ("floor3", "maps_real_slam/avz3floor_complete.yaml", [15.0, 40.0]),
    ("floor5", "maps_real_slam/avz5floor_open_elevatoredit.yaml", [15.0, 40.0]),
];

/// Floor plans of every use, and a task on each.
pub(super) fn generated() -> anyhow::Result<Vec<File>> {
    drawn_plans("rooms", STREAM, PLANS)
}

/// So many floor plans of every use, drawn from `stream`, and a task on each.
pub(super) fn drawn_plans(folder: &str, stream: u64, plans: u64) -> anyhow::Result<Vec<File>> {
    let mut files = Vec::new();
    for (kind, purpose) in Use::ALL.into_iter().enumerate() {
        for k in 0..plans {
            let mut random = rng(stream + kind as u64, k);
            let grid = purpose.draw(&mut random).layout().grid(CELL_M, None)?;
            let name = format!("{}-{}", purpose.name(), k + 1);
            files.extend(map_files(folder, &name, &grid)?);
            let map = StaticMap::new(grid);
            let lengths = if purpose == Use::Void { [18.0, 40.0] } else { [12.0, 30.0] };
            let file = format!("maps/{name}.yaml");
            let mut scenario = drawn_task(&name, &file, &map, lengths, k, &mut random)?;
            if purpose == Use::Void {
                // Landmarks stand at the rim alone, and the middle is out of their sight.
                scenario.laser.range_max = 6.0;
            }
            files.push(scenario_file(folder, &scenario)?);
        }
    }
    Ok(files)
}

/// Tasks on those published maps that are at hand, and which are not.
pub(super) fn published() -> anyhow::Result<(Vec<File>, Vec<String>)> {
    let mut files = Vec::new();
    let mut missing = Vec::new();
    for (kind, (name, file, lengths)) in PUBLISHED.into_iter().enumerate() {
        let reference = format!("dataset:{file}");
        let path = match locate(&reference, Path::new("")) {
            Ok(path) => path,
            Err(error) => {
                missing.push(format!("rooms/{name}-*.toml: {error}"));
                continue;
            }
        };
        let map = StaticMap::new(MapFiles::read(&path)?.grid()?);
        for k in 0..TASKS {
            let mut random = rng(STREAM + 100 + kind as u64, k);
            let scenario =
                drawn_task(&format!("{name}-{}", k + 1), &reference, &map, lengths, k, &mut random)?;
            files.push(scenario_file("rooms", &scenario)?);
        }
    }
    Ok((files, missing))
}

/// A start, a goal and a crowd; `k` decides how people move.
pub(super) fn drawn_task(
    name: &str,
    map_file: &str,
    map: &StaticMap,
    lengths: [f64; 2],
    k: u64,
    random: &mut Rng,
) -> anyhow::Result<Scenario> {
    let (start, goal, length) = endpoints(map, lengths, random).with_context(|| name.to_owned())?;
    let heading = rounded(std::f64::consts::TAU * (uniform(random) - 0.5));
    let start = Pose2::new(start.x, start.y, heading);
    let description = format!("{length:.0} m through {name}, drawn at random.");
    let mut scenario = task(name, &description, map_file, start, goal);
    scenario.laser = LaserModel { range_max: RANGE_M, ..LaserModel::default() };
    scenario.clock.time_limit_s = 150.0;
    scenario.people.motion = [Motion::Scripted, Motion::Hrvo, Motion::SocialForce][(k % 3) as usize];
    // People are as many as the way is busy: what is far from it does not matter.
    let floor = floor_near(map, start.position(), goal);
    let people = ((0.03 + 0.04 * uniform(random)) * floor).clamp(4.0, 60.0).round() as usize;
    let standing = people / 4;
    let walkers =
        Crowd { places: 3, stretch_m: [2.0, 12.0], pause_s: [0.0, 5.0], ..walking(people - standing) };
    scenario.crowds = in_company(walkers);
    scenario.crowds.push(Crowd {
        behaviour: Behaviour::Stand,
        group: [1, 3],
        heedless: 0.0,
        ..walking(standing)
    });
    Ok(scenario)
}

/// A start and a goal with room around them, as far from each other as wanted by the shortest way.
fn endpoints(map: &StaticMap, lengths: [f64; 2], random: &mut Rng) -> anyhow::Result<(Point2, Point2, f64)> {
    let grid = &map.grid;
    let roomy: Vec<usize> = (0..grid.cells().len())
        .filter(|&i| grid.cell(i) == Cell::Free && map.to_obstacle.cell(i) >= 0.7)
        .collect();
    ensure!(!roomy.is_empty(), "the map has no place 0.7 m from walls");
    let place = |random: &mut Rng| {
        let index = roomy[(uniform(random) * roomy.len() as f64) as usize % roomy.len()];
        let p = grid.centre(index % grid.width(), index / grid.width());
        Point2::new(rounded(p.x), rounded(p.y))
    };
    for _ in 0..DRAWS {
        let goal = place(random);
        let field = GeodesicField::new(map, goal, 0.4);
        for _ in 0..DRAWS {
            let start = place(random);
            let length = field.at(start);
            if (lengths[0]..=lengths[1]).contains(&length) {
                return Ok((start, goal, length));
            }
        }
    }
    anyhow::bail!("no two places are {} to {} m from each other", lengths[0], lengths[1])
}

/// Free floor within 6 m around the rectangle from start to goal, square metres.
fn floor_near(map: &StaticMap, start: Point2, goal: Point2) -> f64 {
    let grid = &map.grid;
    let near = |p: Point2| {
        let inside = |a: f64, b: f64, x: f64| x > a.min(b) - 6.0 && x < a.max(b) + 6.0;
        inside(start.x, goal.x, p.x) && inside(start.y, goal.y, p.y)
    };
    let free =
        |&i: &usize| grid.cell(i) == Cell::Free && near(grid.centre(i % grid.width(), i / grid.width()));
    (0..grid.cells().len()).filter(free).count() as f64 * grid.resolution() * grid.resolution()
}
