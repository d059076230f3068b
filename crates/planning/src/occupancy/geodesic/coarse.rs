//! Shortest ways past obstacles that are on no map, derived within a cycle.

use std::sync::Arc;

use super::joined::{CLOSED_SLOWNESS, EXACT_CELLS, Joined};
use super::{GeodesicField, factor};
use crate::geometry::Point2;
use crate::occupancy::{Obstacles, OccupancyGrid, StaticMap};

/// Width of cells that are joined, metres: half of a narrow door.
const WIDTH: f64 = 0.2;

/// Beside walls the robot does not fit with so little room beyond what it keeps from them, metres.
const IMPASSABLE: f64 = -GeodesicField::PLANNING_MARGIN;

/// What lies so near to the start of a way closes nothing, metres: the robot may stand close to an obstacle.
const NEAR_START: f64 = 0.5;

/// Between two places at which a way is looked at, metres.
const SPACING: f64 = 0.1;

/// What cells of about 0.2 m count as for one robot: the cells of a map, joined.
///
/// A joined cell with a wall in it, or unknown floor, is impassable, so that no wall is thin enough to be lost. Of the
/// cells in any other the best counts. So a way that is wider than the robot by 0.3 m stays open.
#[derive(Debug, Clone)]
pub struct CoarseFloor {
    cells: Joined,
    /// Cells of the map along a side of one.
    side: usize,
    /// Room that the robot keeps from walls, metres.
    radius: f64,
}

impl CoarseFloor {
    /// Joins the cells of `map`, for a robot that keeps `radius` metres from walls.
    pub fn new(map: &StaticMap, radius: f64) -> Self {
        let side = ((WIDTH / map.grid.resolution()).round() as usize).max(1);
        let mut floor = Self { cells: Joined::new(map.grid.joined(side)), side, radius };
        for row in 0..floor.cells.grid.height() {
            for column in 0..floor.cells.grid.width() {
                floor.set((column, row), map, |cell| {
                    factor(map.to_obstacle.cell(cell) - radius) * map.way_factor(cell)
                });
            }
        }
        floor
    }

    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.cells.slowness)
    }

    /// Ways to `goal` past `obstacles`. `obstructed` is `map` with those of them that are near the robot: its ways keep
    /// the comfortable distance from these. None of them leads where there is less room beside any, if another does.
    pub fn past(
        &self,
        map: &StaticMap,
        obstructed: &StaticMap,
        obstacles: &Obstacles,
        goal: Point2,
    ) -> GeodesicField {
        let mut floor = self.clone();
        floor.put(obstacles, map, obstructed);
        let Self { cells, radius, .. } = floor;
        let grid = Arc::clone(&cells.grid);
        let field = GeodesicField::marched(grid, cells.slowness.clone(), goal, radius, EXACT_CELLS);
        GeodesicField { floor: Some(Arc::new(cells)), ..field }
    }

    /// Sets the cells in whose neighbourhood there are obstacles.
    fn put(&mut self, obstacles: &Obstacles, map: &StaticMap, obstructed: &StaticMap) {
        let grid = &map.grid;
        let mut closed = vec![false; grid.cells().len()];
        let joined = Arc::clone(&self.cells.grid);
        let mut changed = vec![false; joined.cells().len()];
        let reach = ((self.radius + GeodesicField::COMFORT) / joined.resolution()).ceil() as usize;
        for (column, row) in obstacles.places(grid) {
            close(&mut closed, grid, (column, row), self.radius);
            for (column, row) in joined.around(column / self.side, row / self.side, reach) {
                changed[joined.index(column, row)] = true;
            }
        }
        let radius = self.radius;
        let factor_of = |cell: usize| {
            let room = obstructed.to_obstacle.cell(cell) - radius;
            if closed[cell] || room < IMPASSABLE {
                CLOSED_SLOWNESS
            } else {
                factor(room) * map.way_factor(cell)
            }
        };
        let width = joined.width();
        for index in (0..changed.len()).filter(|index| changed[*index]) {
            self.set((index % width, index / width), map, factor_of);
        }
    }

    /// Sets a joined cell: the best of its cells counts, whose factors are given.
    fn set(&mut self, (column, row): (usize, usize), map: &StaticMap, factor_of: impl Fn(usize) -> f64) {
        let grid = &map.grid;
        let columns = column * self.side..((column + 1) * self.side).min(grid.width());
        let rows = row * self.side..((row + 1) * self.side).min(grid.height());
        let mut best = f64::INFINITY;
        for index in rows.flat_map(|row| columns.clone().map(move |column| grid.index(column, row))) {
            if !grid.is_drivable(index) {
                best = f64::INFINITY;
                break;
            }
            best = best.min(factor_of(index));
        }
        self.cells.set((column, row), best);
    }
}

/// Marks the cells whose centres are nearer than `radius` metres to that of one of them.
fn close(closed: &mut [bool], grid: &OccupancyGrid, (column, row): (usize, usize), radius: f64) {
    let cells = radius / grid.resolution();
    let reach = cells.ceil() as usize;
    for near in row.saturating_sub(reach)..(row + reach + 1).min(grid.height()) {
        let across = near.abs_diff(row) as f64;
        let inside = cells * cells - across * across;
        if inside > 0.0 {
            // The greatest whole number that is less.
            let along = (inside.sqrt().ceil() as usize).saturating_sub(1);
            let first = grid.index(column.saturating_sub(along), near);
            let last = grid.index((column + along).min(grid.width() - 1), near);
            closed[first..=last].fill(true);
        }
    }
}

impl GeodesicField {
    /// Whether obstacles that are on no map close every way from `start` to within `tolerance` metres of the goal: also
    /// the best one leads through them.
    pub fn is_closed(&self, start: Point2, tolerance: f64) -> bool {
        let Some(floor) = &self.floor else { return false };
        let way = self.descend(start, SPACING);
        let mut beyond = way.iter().skip((NEAR_START / SPACING) as usize);
        beyond.any(|p| floor.is_closed(*p) && p.distance(self.goal) > tolerance)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;

    /// 10 m x 10 m at 5 cm with a wall of one cell at x = 5, and doors in the rows that are given.
    fn floor(is_door: impl Fn(usize) -> bool) -> StaticMap {
        let is_wall = |i: usize| i % 200 == 100 && !is_door(i / 200);
        let cells = (0..40_000).map(|i| if is_wall(i) { 100 } else { 0 }).collect();
        StaticMap::new(OccupancyGrid::new(200, 200, 0.05, Pose2::default(), cells).unwrap())
    }

    fn past(map: &StaticMap, cells: Vec<u32>, goal: Point2) -> GeodesicField {
        let obstacles = Obstacles::of(cells);
        CoarseFloor::new(map, 0.35).past(map, &map.with_obstacles(&obstacles), &obstacles, goal)
    }

    #[test]
    fn ways_are_those_of_the_map_and_leave_what_is_closed() {
        let map = floor(|row| (20..40).contains(&row) || (160..180).contains(&row));
        let goal = Point2::new(8.0, 1.5);
        let fine = GeodesicField::new(&map, goal, 0.35);
        let coarse = past(&map, vec![], goal);
        for (x, y) in [(2.0, 1.5), (1.0, 8.0), (9.0, 9.0), (4.0, 5.0)] {
            let p = Point2::new(x, y);
            let ratio = coarse.at(p) / fine.at(p);
            assert!((ratio - 1.0).abs() < 0.08, "{p:?}: {ratio}");
        }
        // A box leaves 0.3 m of the first door: the way leads through the second one.
        let start = Point2::new(2.0, 1.5);
        let cells: Vec<u32> = (20..34).map(|row| row * 200 + 98).collect();
        let from_afar = CoarseFloor::new(&map, 0.35).past(&map, &map, &Obstacles::of(cells.clone()), goal);
        for field in [past(&map, cells, goal), from_afar] {
            let way = field.descend(start, 0.2);
            assert!(way.iter().any(|p| p.y > 7.5) && way.last().unwrap().distance(goal) < 0.5, "{way:?}");
            assert!(!field.is_closed(start, 0.2));
        }
    }

    #[test]
    fn no_way_leads_through_a_wall_however_long_the_way_around_and_one_is_left_where_all_is_closed() {
        let goal = Point2::new(5.5, 0.5);
        let start = Point2::new(4.5, 0.5);
        let open = past(&floor(|row| row >= 180), vec![90 * 200 + 50], goal);
        assert!(open.at(start) > 16.0, "{}", open.at(start));
        let walled = past(&floor(|_| false), vec![90 * 200 + 50], goal);
        assert!(walled.at(start).is_infinite());
        // The only door is closed by a box: the way still leads to it.
        let closed = past(&floor(|row| row >= 180), (180..200).map(|row| row * 200 + 100).collect(), goal);
        assert!(closed.at(start).is_finite() && closed.at(start) > open.at(start) + 5.0);
        assert!(closed.is_closed(start, 0.2) && !open.is_closed(start, 0.2) && !walled.is_closed(start, 0.2));
        // What lies beside the robot closes nothing, and neither does what is as near to the goal as the robot has to
        // be.
        assert!(!closed.is_closed(Point2::new(5.3, 9.2), 0.2) && !closed.is_closed(start, 10.0));
    }
}
