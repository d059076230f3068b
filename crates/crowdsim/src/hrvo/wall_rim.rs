//! Nearest points of walls, for the velocities they forbid.

use curionav_planning::geometry::Point2;
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::{Cell, StaticMap};

use super::Velocity;

/// Most walls minded at once: a person in a dead end has three around it, a doorway adds one.
const MAX_WALLS: usize = 4;

/// A wall near a person.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NearWall {
    /// Direction of its nearest point, map frame, unit length.
    pub towards: Velocity,
    /// Distance of that point, metres.
    pub distance: f64,
}

/// The cells where free space ends, row by row, in which walls near a point are found fast.
#[derive(Debug, Clone)]
pub(crate) struct WallRim {
    /// Where each row's cells begin in `columns`; one more than rows.
    row_starts: Vec<usize>,
    /// Columns of rim cells, ascending within a row.
    columns: Vec<usize>,
    /// Cosine and sine of the grid's heading in the map frame.
    turn: (f64, f64),
}

impl WallRim {
    /// The rim of a map: cells that are not free beside cells that are.
    pub(crate) fn new(map: &StaticMap) -> Self {
        let grid = &map.grid;
        let (width, height) = (grid.width(), grid.height());
        let mut row_starts = vec![0];
        let mut columns = Vec::new();
        for row in 0..height {
            for column in 0..width {
                let beside_free = || {
                    (row.saturating_sub(1)..=(row + 1).min(height - 1)).any(|r| {
                        (column.saturating_sub(1)..=(column + 1).min(width - 1))
                            .any(|c| grid.cell(grid.index(c, r)) == Cell::Free)
                    })
                };
                if grid.cell(grid.index(column, row)) != Cell::Free && beside_free() {
                    columns.push(column);
                }
            }
            row_starts.push(columns.len());
        }
        let (sine, cosine) = sin_cos(grid.origin().heading);
        Self { row_starts, columns, turn: (cosine, sine) }
    }

    /// The walls around `at` within `reach` metres, nearest first: the nearest point, then the nearest of those not behind a line through a nearer one across the view of it, and so on.
    /// A straight wall counts once, a corner of the room twice.
    pub(crate) fn nearest(&self, map: &StaticMap, at: Point2, reach: f64) -> Vec<NearWall> {
        let mut found = Vec::new();
        let grid = &map.grid;
        let cell = grid.resolution();
        // The field says centre to centre: areas may be a diagonal nearer.
        if map.to_obstacle.at(grid, at) > reach + std::f64::consts::SQRT_2 * cell {
            let (x, y) = grid.grid_from_map(at);
            let border = x.min(y).min(grid.width() as f64 - x).min(grid.height() as f64 - y);
            if border * cell > reach {
                return found;
            }
        }
        let mut points = self.points(map, at, reach / cell);
        let (cosine, sine) = self.turn;
        while found.len() < MAX_WALLS {
            let squares = points.iter().map(|&(x, y)| (x * x + y * y, (x, y))).filter(|(far, _)| *far > 0.0);
            let Some((squared, (x, y))) = squares.min_by(|(a, _), (b, _)| a.total_cmp(b)) else { break };
            let distance = squared.sqrt();
            let (ux, uy) = (x / distance, y / distance);
            found.push(NearWall {
                towards: Velocity::new(cosine * ux - sine * uy, sine * ux + cosine * uy),
                distance: distance * cell,
            });
            // A cell of slack: a slanting wall is a staircase.
            points.retain(|(px, py)| px * ux + py * uy < distance - 1.0);
        }
        found
    }

    /// The nearest points of the rim cells and of the map's border within `reach` cells, as offsets.
    fn points(&self, map: &StaticMap, at: Point2, reach: f64) -> Vec<(f64, f64)> {
        let (width, height) = (map.grid.width(), map.grid.height());
        let (x, y) = map.grid.grid_from_map(at);
        let squared = reach * reach;
        let border = [(-x, 0.0), (width as f64 - x, 0.0), (0.0, -y), (0.0, height as f64 - y)];
        let near = |(dx, dy): &(f64, f64)| dx * dx + dy * dy <= squared;
        let mut points: Vec<_> = border.into_iter().filter(near).collect();
        let row = |y: f64| (y.max(0.0) as usize).min(height - 1);
        let first_column = (x - reach - 1.0).max(0.0) as usize;
        for r in row(y - reach)..=row(y + reach) {
            let cells = &self.columns[self.row_starts[r]..self.row_starts[r + 1]];
            let dy = offset_to(y, r as f64);
            for &c in &cells[cells.partition_point(|c| *c < first_column)..] {
                if c as f64 > x + reach {
                    break;
                }
                points.extend(Some((offset_to(x, c as f64), dy)).filter(near));
            }
        }
        points
    }
}

/// Offset from `x` to the nearest point of [from, from + 1].
fn offset_to(x: f64, from: f64) -> f64 {
    (from - x).max(0.0) + (from + 1.0 - x).min(0.0)
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Pose2;
    use curionav_planning::occupancy::OccupancyGrid;
    use curionav_planning::random::{rng, uniform};

    use super::*;
    use crate::walls::wall_distance;

    fn map(heading: f64, wall: impl Fn(usize, usize) -> bool) -> StaticMap {
        let cells = (0..6400).map(|i| if wall(i % 80, i / 80) { 100 } else { 0 }).collect();
        StaticMap::new(OccupancyGrid::new(80, 80, 0.05, Pose2::new(0.0, 0.0, heading), cells).unwrap())
    }

    fn near(map: &StaticMap, x: f64, y: f64, reach: f64) -> Vec<NearWall> {
        WallRim::new(map).nearest(map, Point2::new(x, y), reach)
    }

    #[test]
    fn a_straight_wall_counts_once_and_a_room_corner_twice() {
        let corner = map(0.0, |c, r| c >= 60 || r >= 60); // walls at x = 3 and y = 3
        let found = near(&corner, 2.6, 1.0, 0.7);
        assert_eq!(found.len(), 1);
        assert!((found[0].distance - 0.4).abs() < 1e-9);
        assert!((found[0].towards - Velocity::x()).norm() < 1e-9);
        let found = near(&corner, 2.6, 2.5, 0.7);
        assert_eq!(found.len(), 2);
        assert!((found[1].distance - 0.5).abs() < 1e-9 && (found[1].towards - Velocity::y()).norm() < 1e-9);
    }

    #[test]
    fn a_slanting_wall_counts_once() {
        let slanting = map(0.0, |c, r| c + r >= 90);
        assert_eq!(near(&slanting, 2.0, 2.0, 0.8).len(), 1);
    }

    #[test]
    fn the_border_of_the_map_is_a_wall_and_far_walls_are_none() {
        let empty = map(0.0, |_, _| false);
        assert_eq!(near(&empty, 0.3, 0.2, 0.5).len(), 2);
        assert!(near(&empty, 2.0, 2.0, 0.5).is_empty());
    }

    #[test]
    fn the_first_is_at_the_exact_distance_and_in_its_direction() {
        for seed in 0..20 {
            let mut r = rng(seed, 0);
            let walls: Vec<bool> = (0..6400).map(|_| uniform(&mut r) < 0.01).collect();
            let map = map(0.4, |c, r| walls[80 * r + c]);
            for _ in 0..50 {
                let p = Point2::new(4.0 * uniform(&mut r), 4.0 * uniform(&mut r));
                let p = map.grid.origin().transform(p);
                let found = near(&map, p.x, p.y, 0.8);
                let expected = wall_distance(&map, p);
                if expected == 0.0 || expected > 0.8 {
                    continue;
                }
                assert!((found[0].distance - expected).abs() < 1e-9, "seed {seed}");
                let step = 0.5 * expected;
                let nearer = Point2::new(p.x + step * found[0].towards.x, p.y + step * found[0].towards.y);
                assert!((wall_distance(&map, nearer) - step).abs() < 1e-9, "seed {seed}");
            }
        }
    }
}
