//! `bench.json`: what was run, and where; all that a report needs beside the journal.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use curionav_deployment::package::Perception;
use curionav_schemas::OccupancyGrid;
use serde::Serialize;

use super::options::What;
use super::places::places;
use super::plan::{Plan, Planner, Scene};
use super::row::Row;
use super::worker_process::Missing;
use crate::paper::{PUBLISHED, Published};

/// Cells of a picture's map at most.
const PICTURE_CELLS: usize = 40_000;
/// From this value on a cell of a picture is a wall, per cent.
const OCCUPIED: i8 = 50;

#[derive(Debug, Serialize)]
pub(super) struct Manifest<'a> {
    version: &'static str,
    /// Digests of the builds that made the runs.
    programs: BTreeSet<&'a str>,
    planners: &'a [Planner],
    scenarios: Vec<Site<'a>>,
    first_seed: u64,
    repeats: u32,
    /// How people are known, unless as the scenarios say.
    perception: Option<Perception>,
    workers: usize,
    /// What the runs took on the clock with all workers busy, s.
    clock_s: f64,
    /// Files of claims, as they were named.
    claims: &'a [PathBuf],
    missing: Vec<NoRun<'a>>,
}

#[derive(Debug, Serialize)]
struct NoRun<'a> {
    scenario: &'a str,
    planner: &'a str,
    seed: u64,
    reason: &'a str,
}

/// A scenario as a reader of results needs it.
#[derive(Debug, Serialize)]
struct Site<'a> {
    name: &'a str,
    description: &'a str,
    file: &'a Path,
    /// Scenarios with the same number are in one place, from 0 on.
    place: usize,
    people: usize,
    motion: String,
    people_per_m2: f64,
    cell_m: f64,
    known_cells: usize,
    landmark_cells: usize,
    laser_range_m: f64,
    start: [f64; 2],
    goal: [f64; 2],
    goal_tolerance_m: f64,
    robot_radius_m: f64,
    person_radius_m: f64,
    /// `Thr'` of the first planner, m2 + rad2.
    threshold: f64,
    time_limit_s: f64,
    /// What the paper prints of it.
    paper: Option<&'static Published>,
    picture: Picture,
}

/// A map in larger cells, for a picture.
#[derive(Debug, Serialize)]
struct Picture {
    cell_m: f64,
    /// Where the lower left corner is, m, and how the map is turned, rad.
    origin: [f64; 3],
    /// The lowest row first: `#` wall, `?` unknown, `-` floor without a landmark in the laser's range, `.` other floor.
    rows: Vec<String>,
}

impl<'a> Manifest<'a> {
    /// Of the runs that took place, and of those that are missing.
    pub(super) fn new(
        plan: &'a Plan,
        what: &What,
        claims: &'a [PathBuf],
        rows: &[&'a Row],
        missing: &'a [Missing],
        workers: usize,
    ) -> Self {
        let worked: f64 = rows.iter().map(|row| row.wall_s).sum();
        let places = places(plan.scenes.iter().map(|scene| &scene.map));
        Self {
            version: env!("CARGO_PKG_VERSION"),
            programs: rows.iter().map(|row| row.program.as_str()).collect(),
            planners: &plan.planners,
            scenarios: plan.scenes.iter().zip(places).map(|(scene, place)| Site::new(scene, place)).collect(),
            first_seed: what.first_seed,
            repeats: what.repeats,
            perception: plan.perception,
            workers,
            clock_s: worked / workers as f64,
            claims,
            missing: missing.iter().map(NoRun::new).collect(),
        }
    }
}

impl<'a> NoRun<'a> {
    fn new(Missing { job, reason }: &'a Missing) -> Self {
        Self { scenario: &job.scenario, planner: &job.planner, seed: job.seed, reason }
    }
}

impl<'a> Site<'a> {
    fn new(scene: &'a Scene, place: usize) -> Self {
        let Scene { scenario, map, .. } = scene;
        let robot = &scenario.robot;
        Self {
            name: scene.name(),
            description: &scenario.description,
            file: &scene.file,
            place,
            people: scene.people(),
            motion: scene.motion(),
            people_per_m2: scene.density(),
            cell_m: map.resolution,
            known_cells: map.cells.iter().filter(|cell| **cell >= 0).count(),
            landmark_cells: map.cells.iter().filter(|cell| **cell > 0).count(),
            laser_range_m: scenario.laser.range_max,
            start: [robot.start.x, robot.start.y],
            goal: [robot.goal.x, robot.goal.y],
            goal_tolerance_m: robot.goal_tolerance,
            robot_radius_m: robot.model.radius(),
            person_radius_m: scenario.people.radius,
            threshold: scene.threshold,
            time_limit_s: scenario.clock.time_limit_s,
            paper: PUBLISHED.iter().find(|published| published.name == scene.name()),
            picture: Picture::new(map, &scene.bare),
        }
    }
}

impl Picture {
    /// In the smallest square blocks of cells that are not too many.
    fn new(map: &OccupancyGrid, bare: &[bool]) -> Self {
        let width = map.width as usize;
        let height = map.height as usize;
        let mut size = 1;
        while width.div_ceil(size) * height.div_ceil(size) > PICTURE_CELLS {
            size += 1;
        }
        let columns = width.div_ceil(size);
        // A block with a wall in it is a wall; it is bare or unknown if all of it is.
        let mut blocks = vec!['?'; columns * height.div_ceil(size)];
        for (index, cell) in map.cells.iter().enumerate() {
            let block = &mut blocks[(index / width / size) * columns + index % width / size];
            *block = match (*block, *cell) {
                ('#', _) | (_, OCCUPIED..) => '#',
                ('.', _) => '.',
                (before, ..0) => before,
                (_, 0) if bare[index] => '-',
                _ => '.',
            };
        }
        Self {
            cell_m: map.resolution * size as f64,
            origin: [map.origin.x, map.origin.y, map.origin.heading],
            rows: blocks.chunks(columns.max(1)).map(|row| row.iter().collect()).collect(),
        }
    }
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use super::*;

    #[test]
    fn a_picture_of_a_large_map_keeps_its_walls() {
        let cells: Vec<i8> = (0..400 * 300).map(|i| if i == 5 { 100 } else { 0 }).collect();
        let map = OccupancyGrid {
            width: 400,
            height: 300,
            resolution: 0.05,
            cells: cells.into(),
            ..golden::occupancy_grid()
        };
        let bare: Vec<bool> = (0..400 * 300).map(|i| i % 400 < 202).collect();
        let picture = Picture::new(&map, &bare);
        assert_eq!((picture.cell_m, picture.rows.len(), picture.rows[0].len()), (0.1, 150, 200));
        assert_eq!(&picture.rows[0][..4], "--#-");
        assert_eq!(&picture.rows[149][99..103], "--..");
    }

    #[test]
    fn what_is_unknown_is_so_in_the_picture() {
        let cells = vec![-1_i8, 0, 40, 60];
        let map = OccupancyGrid { width: 4, height: 1, cells: cells.into(), ..golden::occupancy_grid() };
        assert_eq!(Picture::new(&map, &[false, true, false, false]).rows, ["?-.#"]);
    }
}
