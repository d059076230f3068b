//! Nearest points of walls, for the velocities they forbid.

use std::ops::RangeInclusive;

use curionav_planning::geometry::Point2;
use curionav_planning::hrvo::Velocity;
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::{Cell, OccupancyGrid, StaticMap};

use crate::walls::border_distance;

/// Most walls minded at once: a person in a dead end has three around it, a doorway adds one.
const MAX_WALLS: usize = 4;

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct NearWall {
    /// Direction of its nearest point, map frame, unit length.
    pub towards: Velocity,
    /// Distance of that point, metres.
    pub distance: f64,
}

/// The walls around `at` within `reach` metres, nearest first: the nearest point, then the nearest of those not behind
/// a line through a nearer one across the view of it, and so on. A straight wall counts once, a corner of the room
/// twice.
pub(crate) fn nearest_walls(map: &StaticMap, at: Point2, reach: f64) -> Vec<NearWall> {
    let mut found = Vec::new();
    let grid = &map.grid;
    let cell = grid.resolution();
    // The field says centre to centre: areas may be a diagonal nearer.
    if map.to_obstacle.at(grid, at) > reach + std::f64::consts::SQRT_2 * cell {
        let (x, y) = grid.grid_from_map(at);
        if border_distance(x, y, grid.width(), grid.height()) * cell > reach {
            return found;
        }
    }
    let mut points = rim_points(map, at, reach / cell);
    let (sine, cosine) = sin_cos(grid.origin().heading);
    while found.len() < MAX_WALLS {
        let squares = points.iter().map(|&(x, y)| (x * x + y * y, (x, y))).filter(|(far, _)| *far > 0.0);
        let Some((squared, (x, y))) = squares.min_by(|(a, _), (b, _)| a.total_cmp(b)) else { break };
        let distance = squared.sqrt();
        let ux = x / distance;
        let uy = y / distance;
        found.push(NearWall {
            towards: Velocity::new(cosine * ux - sine * uy, sine * ux + cosine * uy),
            distance: distance * cell,
        });
        // A cell of slack: a slanting wall is a staircase.
        points.retain(|(px, py)| px * ux + py * uy < distance - 1.0);
    }
    found
}

/// The nearest points of the map's border and of the cells where free space ends, within `reach` cells, as offsets.
fn rim_points(map: &StaticMap, at: Point2, reach: f64) -> Vec<(f64, f64)> {
    let grid = &map.grid;
    let width = grid.width();
    let height = grid.height();
    let (x, y) = grid.grid_from_map(at);
    let mut points = vec![(-x, 0.0), (width as f64 - x, 0.0), (0.0, -y), (0.0, height as f64 - y)];
    for row in within(y - reach, y + reach, height) {
        for column in within(x - reach - 1.0, x + reach, width) {
            if is_rim(grid, column, row) {
                points.push((offset_to(x, column as f64), offset_to(y, row as f64)));
            }
        }
    }
    points.retain(|(dx, dy)| dx * dx + dy * dy <= reach * reach);
    points
}

/// The cells of a row or column of `count` that lie within [from, to].
fn within(from: f64, to: f64, count: usize) -> RangeInclusive<usize> {
    (from.max(0.0) as usize).min(count - 1)..=(to.max(0.0) as usize).min(count - 1)
}

/// Whether a cell is not free and has a free one among the eight around it.
fn is_rim(grid: &OccupancyGrid, column: usize, row: usize) -> bool {
    let rows = row.saturating_sub(1)..=(row + 1).min(grid.height() - 1);
    let columns = column.saturating_sub(1)..=(column + 1).min(grid.width() - 1);
    !is_free(grid, column, row)
        && rows.into_iter().any(|row| columns.clone().any(|column| is_free(grid, column, row)))
}

fn is_free(grid: &OccupancyGrid, column: usize, row: usize) -> bool {
    grid.cell(grid.index(column, row)) == Cell::Free
}

/// Offset from `x` to the nearest point of [from, from + 1].
fn offset_to(x: f64, from: f64) -> f64 {
    (from - x).max(0.0) + (from + 1.0 - x).min(0.0)
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Pose2;
    use curionav_planning::random::{rng, uniform};

    use super::*;
    use crate::walls::wall_distance;

    fn map(heading: f64, wall: impl Fn(usize, usize) -> bool) -> StaticMap {
        let cells = (0..6400).map(|i| if wall(i % 80, i / 80) { 100 } else { 0 }).collect();
        StaticMap::new(OccupancyGrid::new(80, 80, 0.05, Pose2::new(0.0, 0.0, heading), cells).unwrap())
    }

    fn near(map: &StaticMap, x: f64, y: f64, reach: f64) -> Vec<NearWall> {
        nearest_walls(map, Point2::new(x, y), reach)
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
