//! Exact distances to walls: the truth that collisions are judged by.

use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::StaticMap;

/// Distances beyond this one are read from the map's distance field, within a cell's diagonal; nearer
/// ones are exact, metres.
const EXACT_WITHIN: f64 = 1.0;

/// Distance from a point to the nearest area that is not known to be free, metres; 0 inside it and
/// outside the map. Unknown space counts as wall: the robot cannot leave the known world.
pub(crate) fn wall_distance(map: &StaticMap, p: Point2) -> f64 {
    let grid = &map.grid;
    let Some((column, row)) = grid.locate(p) else { return 0.0 };
    let centres = map.to_obstacle.cell(grid.index(column, row));
    if centres > EXACT_WITHIN {
        return centres;
    }
    let (x, y) = grid.grid_from_map(p);
    let border = border_distance(x, y, grid.width(), grid.height()) * grid.resolution();
    map.to_obstacle.exact_clearance(grid, p).min(border)
}

/// Distance from a point on the map to its border, in the unit of all four, which are cells.
pub(crate) fn border_distance(x: f64, y: f64, width: usize, height: usize) -> f64 {
    x.min(y).min(width as f64 - x).min(height as f64 - y)
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Pose2;
    use curionav_planning::occupancy::OccupancyGrid;
    use curionav_planning::random::{rng, uniform};

    use super::*;

    /// How far outside [from, from + 1] a coordinate lies.
    fn beside(x: f64, from: f64) -> f64 {
        (from - x).max(x - from - 1.0).max(0.0)
    }

    #[test]
    fn equals_the_distance_to_every_wall_cell() {
        for seed in 0..20 {
            let mut r = rng(seed, 0);
            let cells: Vec<i8> = (0..1600).map(|_| if uniform(&mut r) < 0.02 { 100 } else { 0 }).collect();
            let origin = Pose2::new(-1.0, 2.0, 0.4);
            let map = StaticMap::new(OccupancyGrid::new(40, 40, 0.05, origin, cells.clone()).unwrap());
            for _ in 0..200 {
                let (x, y) = (40.0 * uniform(&mut r), 40.0 * uniform(&mut r));
                let p = origin.transform(Point2::new(0.05 * x, 0.05 * y));
                let mut expected = border_distance(x, y, 40, 40);
                for (i, _) in cells.iter().enumerate().filter(|(_, c)| **c == 100) {
                    let (dx, dy) = (beside(x, (i % 40) as f64), beside(y, (i / 40) as f64));
                    expected = expected.min((dx * dx + dy * dy).sqrt());
                }
                assert!((wall_distance(&map, p) - 0.05 * expected).abs() < 1e-9, "seed {seed}");
            }
        }
    }
}
