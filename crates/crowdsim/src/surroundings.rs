//! What is solid around robot and people: the walls that are really there, and the things that are on no map.

use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::{Cell, StaticMap};

use crate::scenario::{Region, WorldSetup, contains};
use crate::things::Things;
use crate::walls::wall_distance;

#[derive(Debug, Clone)]
pub(crate) struct Surroundings {
    /// The map without the walls that are gone.
    walls: StaticMap,
    /// The walls, and the things that stand now: where people walk.
    floor: StaticMap,
    things: Things,
}

impl Surroundings {
    /// What there is at the start.
    pub(crate) fn new(map: &StaticMap, setup: &WorldSetup) -> Self {
        let walls = if setup.openings.is_empty() { map.clone() } else { opened(map, &setup.openings) };
        let things = Things::new(&setup.objects);
        Self { floor: floor(&walls, &things), walls, things }
    }

    /// What there is at `time`, seconds, after another `dt`, while a robot of `radius` metres stands at `robot`.
    pub(crate) fn step(&mut self, time: f64, dt: f64, robot: Point2, radius: f64) {
        if self.things.step(time, dt, robot, radius) {
            self.floor = floor(&self.walls, &self.things);
        }
    }

    pub(crate) fn walls(&self) -> &StaticMap {
        &self.walls
    }

    pub(crate) fn floor(&self) -> &StaticMap {
        &self.floor
    }

    pub(crate) fn things(&self) -> &Things {
        &self.things
    }

    /// Distance from a point to what is solid, metres; 0 inside it and outside the map.
    pub(crate) fn distance(&self, p: Point2) -> f64 {
        wall_distance(&self.walls, p).min(self.things.distance(p))
    }

    /// Whether a body of `radius` metres at `p` touches nothing.
    pub(crate) fn is_clear(&self, p: Point2, radius: f64) -> bool {
        let map = &self.walls;
        let is_clear_of_walls =
            map.to_obstacle.least_clearance(&map.grid, p) >= radius || wall_distance(map, p) >= radius;
        is_clear_of_walls && self.things.distance(p) >= radius
    }
}

/// The map without the walls in these parts of the floor.
fn opened(map: &StaticMap, openings: &[Region]) -> StaticMap {
    let grid = &map.grid;
    StaticMap::new(grid.changed(|index, value| {
        let centre = grid.centre(index % grid.width(), index / grid.width());
        let is_wall = grid.cell(index) == Cell::Occupied;
        let is_gone = is_wall && openings.iter().any(|region| contains(&region.corners, centre));
        if is_gone { 0 } else { value }
    }))
}

fn floor(walls: &StaticMap, things: &Things) -> StaticMap {
    let covered = things.covered(&walls.grid);
    if covered.is_empty() {
        return walls.clone();
    }
    StaticMap::new(walls.grid.changed(|index, value| if covered.contains(&index) { 100 } else { value }))
}
