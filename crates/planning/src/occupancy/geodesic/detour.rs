//! Shortest ways past people, who are on no map.

use std::ops::Range;

use super::{EXACT_CELLS, GeodesicField, March, beside, between, descend, factor, joined, slowness};
use crate::geometry::Point2;
use crate::occupancy::StaticMap;

/// How far around the robot people are gone around, metres.
const REACH: f64 = 6.0;

/// Distance to go, metres, where bodies stand in the ways of a [`GeodesicField`], which knows walls alone: what a
/// costmap gives that has people in it.
///
/// A square around the robot is marched again with the bodies in it, as close to them as to walls, from where ways lead
/// out of it. Where the bodies leave the robot no way, the ways are those of the walls.
#[derive(Debug)]
pub struct Detour<'a> {
    walls: &'a GeodesicField,
    square: Option<Square>,
}

/// The cells that are marched again.
#[derive(Debug)]
struct Square {
    columns: Range<usize>,
    rows: Range<usize>,
    /// `[row, column]`.
    metres: Vec<f32>,
}

impl<'a> Detour<'a> {
    /// The ways of `walls`, which was made for `map`, past bodies with their radii, metres, for a robot that is `here`.
    pub fn new(
        walls: &'a GeodesicField,
        map: &StaticMap,
        here: Point2,
        bodies: impl Iterator<Item = (Point2, f64)>,
    ) -> Self {
        let near: Vec<(Point2, f64)> = bodies
            .filter(|(body, radius)| {
                let reach = REACH + (radius + walls.radius + GeodesicField::COMFORT);
                (body.x - here.x).abs() < reach && (body.y - here.y).abs() < reach
            })
            .collect();
        let square = (!near.is_empty()).then(|| Square::new(walls, map, here, &near)).flatten();
        let mut detour = Self { walls, square };
        if !detour.at(here).is_finite() {
            detour.square = None;
        }
        detour
    }

    /// Distance to go from a point, metres, as [`GeodesicField::at`] gives it.
    pub fn at(&self, p: Point2) -> f64 {
        let inside = self.square.as_ref().and_then(|square| square.at(self.walls, p));
        inside.unwrap_or_else(|| self.walls.at(p))
    }

    /// The first `length` metres of the shortest way from `start`, as [`GeodesicField::descend_for`] gives them.
    pub fn descend_for(&self, start: Point2, spacing: f64, length: f64) -> Vec<Point2> {
        descend(|p| self.at(p), &self.walls.directions, start, spacing, length)
    }
}

impl Square {
    fn new(walls: &GeodesicField, map: &StaticMap, here: Point2, bodies: &[(Point2, f64)]) -> Option<Self> {
        let grid = &walls.grid;
        let (column, row) = grid.locate(here)?;
        let half = (REACH / grid.resolution()).ceil() as usize;
        let columns = column.saturating_sub(half)..(column + half + 1).min(grid.width());
        let rows = row.saturating_sub(half)..(row + half + 1).min(grid.height());
        let slowness = match &walls.floor {
            Some(floor) => floor.part(&columns, &rows),
            None => slowness(map, walls.radius, columns.clone(), rows.clone()),
        };
        let march = March::new(columns.len(), slowness);
        let mut marching = Marching { walls, columns, rows, march };
        for &(body, radius) in bodies {
            marching.put_in(body, radius);
        }
        marching.lead_out();
        let exact = if walls.floor.is_some() { joined::EXACT_CELLS } else { EXACT_CELLS };
        for ((column, row), metres) in beside(grid, walls.goal, exact) {
            if marching.columns.contains(&column) && marching.rows.contains(&row) {
                marching.start(column, row, metres);
            }
        }
        let Marching { columns, rows, march, .. } = marching;
        Some(Self { columns, rows, metres: march.run() })
    }

    /// Distance to go from a point of the square; `None` outside.
    fn at(&self, walls: &GeodesicField, p: Point2) -> Option<f64> {
        let (c, r) = walls.grid.grid_from_map(p);
        let c = c - 0.5 - self.columns.start as f64;
        let r = r - 0.5 - self.rows.start as f64;
        let width = self.columns.len();
        let height = self.rows.len();
        let is_inside = c >= 0.0 && r >= 0.0 && c <= (width - 1) as f64 && r <= (height - 1) as f64;
        is_inside.then(|| between(&self.metres, (width, height), (c, r)))
    }
}

/// The march over a [`Square`], before it begins. Columns and rows are those of the grid.
struct Marching<'a> {
    walls: &'a GeodesicField,
    columns: Range<usize>,
    rows: Range<usize>,
    march: March,
}

impl Marching<'_> {
    /// Makes the cells around a body as slow as those along walls, and those that it fills impassable.
    fn put_in(&mut self, body: Point2, radius: f64) {
        let grid = &self.walls.grid;
        let cells = (radius + self.walls.radius + GeodesicField::COMFORT) / grid.resolution();
        let (column, row) = grid.grid_from_map(body);
        for r in within(row, cells, &self.rows) {
            for c in within(column, cells, &self.columns) {
                let room = grid.centre(c, r).distance(body) - radius - self.walls.radius;
                let slowness = if room < -GeodesicField::PLANNING_MARGIN {
                    f32::INFINITY
                } else {
                    (factor(room) * grid.resolution()) as f32
                };
                let cell = self.march.bordered(c - self.columns.start, r - self.rows.start);
                self.march.slowness[cell] = self.march.slowness[cell].max(slowness);
            }
        }
    }

    /// Starts from the cells of the rim that have a neighbour outside which is nearer to the goal.
    fn lead_out(&mut self) {
        for column in self.columns.clone() {
            self.leave((column, self.rows.start), (Some(column), self.rows.start.checked_sub(1)));
            self.leave((column, self.rows.end - 1), (Some(column), Some(self.rows.end)));
        }
        for row in self.rows.clone() {
            self.leave((self.columns.start, row), (self.columns.start.checked_sub(1), Some(row)));
            self.leave((self.columns.end - 1, row), (Some(self.columns.end), Some(row)));
        }
    }

    /// Starts from a cell of the rim if the cell `beyond` it, which may not exist, is nearer to the goal.
    fn leave(&mut self, (column, row): (usize, usize), beyond: (Option<usize>, Option<usize>)) {
        let grid = &self.walls.grid;
        let (Some(c), Some(r)) = beyond else { return };
        if c >= grid.width() || r >= grid.height() {
            return;
        }
        let metres = self.to_go(column, row);
        if self.to_go(c, r) < metres {
            self.start(column, row, metres);
        }
    }

    fn start(&mut self, column: usize, row: usize, metres: f32) {
        self.march.start(column - self.columns.start, row - self.rows.start, metres);
    }

    /// What the walls' field says of a cell, metres.
    fn to_go(&self, column: usize, row: usize) -> f32 {
        self.walls.metres[row * self.walls.grid.width() + column]
    }
}

/// Those of `all` cells that begin less than `cells` from `at`.
fn within(at: f64, cells: f64, all: &Range<usize>) -> Range<usize> {
    let first = (at - cells).floor().max(all.start as f64) as usize;
    let end = (at + cells).ceil().max(0.0) as usize;
    first..end.clamp(first, all.end.max(first))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use crate::occupancy::OccupancyGrid;

    const GOAL: Point2 = Point2 { x: 20.0, y: 10.0 };
    const HERE: Point2 = Point2 { x: 5.0, y: 10.0 };

    /// A hall of 25 m by 20 m with a wall along its middle but for a gap of 2 m, `GOAL` on its right.
    fn hall(has_wall: bool) -> StaticMap {
        let mut cells = vec![0_i8; 250 * 200];
        for row in (0..90).chain(110..200).filter(|_| has_wall) {
            cells[row * 250 + 80] = 100;
        }
        StaticMap::new(OccupancyGrid::new(250, 200, 0.1, Pose2::default(), cells).unwrap())
    }

    fn ways<'a>(walls: &'a GeodesicField, map: &StaticMap, bodies: &[(f64, f64)]) -> Detour<'a> {
        Detour::new(walls, map, HERE, bodies.iter().map(|&(x, y)| (Point2::new(x, y), 0.25)))
    }

    #[test]
    fn a_person_in_the_way_is_gone_around_and_one_aside_changes_nothing() {
        let map = hall(false);
        let walls = GeodesicField::new(&map, GOAL, 0.45);
        let past = ways(&walls, &map, &[(7.0, 10.1)]);
        let way = past.descend_for(HERE, 0.2, 20.0);
        let nearest = way.iter().map(|p| p.distance(Point2::new(7.0, 10.1))).fold(f64::INFINITY, f64::min);
        assert!(nearest > 0.65, "the way comes within {nearest} m of the person");
        assert!(way.iter().all(|p| p.y < 10.2), "the way goes round the far side");
        assert!(way.last().unwrap().distance(GOAL) < 0.5);
        let longer = past.at(HERE) - walls.at(HERE);
        assert!(longer > 0.05 && longer < 0.5, "{longer}");
        // Beyond the person nothing is longer, and neither is anything with a person far from the way.
        let aside = ways(&walls, &map, &[(2.0, 14.0)]);
        for p in [Point2::new(8.5, 10.0), Point2::new(14.0, 10.0), HERE] {
            assert!((aside.at(p) - walls.at(p)).abs() < 0.05, "{p:?}");
        }
        assert!((past.at(Point2::new(8.5, 10.0)) - walls.at(Point2::new(8.5, 10.0))).abs() < 0.05);
        let alone = ways(&walls, &map, &[]);
        assert_eq!(alone.at(HERE).to_bits(), walls.at(HERE).to_bits());
        assert_eq!(alone.descend_for(HERE, 0.2, 3.0), walls.descend_for(HERE, 0.2, 3.0));
    }

    #[test]
    fn where_people_leave_no_way_the_ways_are_those_of_the_walls() {
        let map = hall(true);
        let walls = GeodesicField::new(&map, GOAL, 0.45);
        let row: Vec<(f64, f64)> = (0..5).map(|k| (8.0, 9.2 + 0.4 * f64::from(k))).collect();
        let blocked = ways(&walls, &map, &row);
        assert_eq!(blocked.at(HERE).to_bits(), walls.at(HERE).to_bits());
        // With one of them gone at the side, the way leads through there.
        let open = ways(&walls, &map, &row[3..]);
        assert!(open.at(HERE).is_finite() && open.at(HERE) > walls.at(HERE));
        let at_wall = open
            .descend_for(HERE, 0.2, 6.0)
            .into_iter()
            .min_by(|a, b| (a.x - 8.0).abs().total_cmp(&(b.x - 8.0).abs()));
        assert!(at_wall.unwrap().y < 9.9, "{at_wall:?}");
    }

    #[test]
    fn a_goal_in_the_square_is_reached_past_people_and_robots_that_touch_them_have_a_way() {
        let map = hall(false);
        let goal = Point2::new(8.0, 10.0);
        let walls = GeodesicField::new(&map, goal, 0.45);
        let past = ways(&walls, &map, &[(6.5, 10.0), (5.56, 10.0)]);
        assert!(past.at(goal) < 0.1);
        let way = past.descend_for(HERE, 0.1, 20.0);
        assert!(way.last().unwrap().distance(goal) < 0.3, "{:?}", way.last());
        assert!(way.iter().skip(5).all(|p| p.distance(Point2::new(6.5, 10.0)) > 0.6));
    }
}
