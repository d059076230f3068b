//! What a laser can make of a place: which beams meet landmarks, and how well they hold a position.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::{eigenvalues, sin_cos};
use curionav_planning::occupancy::{Cell, StaticMap};
use curionav_planning::sensor::LaserModel;

/// Unit normals of the surfaces that the beams meet within range, seen from `pose` without people and noise.
pub(super) fn look(map: &StaticMap, laser: &LaserModel, pose: Pose2) -> Vec<Point2> {
    let eye = pose.compose(laser.robot_from_laser);
    let direction = |beam| sin_cos(eye.heading + laser.bearing(beam));
    let meet = |beam| meet(map, eye.position(), direction(beam), laser.range_max);
    (0..laser.beams).filter_map(meet).collect()
}

/// Least eigenvalue of the sum of `n n'` over the normals `n`: as many beams as would meet a wall head-on across the
/// weakest direction. 0 along a smooth corridor.
pub(super) fn hold(normals: &[Point2]) -> f64 {
    let sum = |product: fn(&Point2) -> f64| normals.iter().map(product).sum::<f64>();
    let xx = sum(|n| n.x * n.x);
    let xy = sum(|n| n.x * n.y);
    let yy = sum(|n| n.y * n.y);
    eigenvalues(xx, xy, yy).1.max(0.0)
}

/// Unit normal of the surface a beam meets, if any: the gradient of the distance field a little before.
fn meet(map: &StaticMap, from: Point2, (s, c): (f64, f64), range: f64) -> Option<Point2> {
    let cell = map.grid.resolution();
    let mut travelled = 0.0;
    while travelled <= range {
        let p = Point2::new(from.x + c * travelled, from.y + s * travelled);
        if map.grid.at(p) == Cell::Occupied {
            let back = travelled - 3.0 * cell;
            return normal(map, Point2::new(from.x + c * back, from.y + s * back));
        }
        // The field is exact between cell centres, so a cell's diagonal less is always safe.
        travelled += (map.to_occupied.at(&map.grid, p) - 1.5 * cell).max(0.5 * cell);
    }
    None
}

fn normal(map: &StaticMap, p: Point2) -> Option<Point2> {
    let step = 2.0 * map.grid.resolution();
    let at = |dx: f64, dy: f64| map.to_occupied.at(&map.grid, Point2::new(p.x + dx, p.y + dy));
    let gx = at(step, 0.0) - at(-step, 0.0);
    let gy = at(0.0, step) - at(0.0, -step);
    let size = (gx * gx + gy * gy).sqrt();
    (size > 0.0).then(|| Point2::new(gx / size, gy / size))
}

#[cfg(test)]
mod tests {
    use curionav_planning::occupancy::OccupancyGrid;

    use super::*;

    /// 20 m x 4 m at 0.1 m, walls along both long sides, and one across at `x` if any.
    fn corridor(across: Option<usize>) -> StaticMap {
        let cells = (0..200 * 40)
            .map(|i| {
                let column = i % 200;
                let row = i / 200;
                if row == 0 || row == 39 || Some(column) == across { 100 } else { 0 }
            })
            .collect();
        StaticMap::new(OccupancyGrid::new(200, 40, 0.1, Pose2::default(), cells).unwrap())
    }

    #[test]
    fn a_smooth_corridor_does_not_hold_and_a_wall_across_does() {
        let laser = LaserModel::default();
        let pose = Pose2::new(10.0, 2.0, 0.0);
        let smooth = look(&corridor(None), &laser, pose);
        let closed = look(&corridor(Some(130)), &laser, pose);
        assert!(smooth.len() > 100 && hold(&smooth) < 0.5, "{smooth:?}");
        assert!(hold(&closed) > 20.0, "{closed:?}");
    }

    #[test]
    fn nothing_in_range_is_nothing_seen() {
        let open =
            StaticMap::new(OccupancyGrid::new(100, 100, 0.1, Pose2::default(), vec![0; 10_000]).unwrap());
        let sight = look(&open, &LaserModel::default(), Pose2::new(5.0, 5.0, 1.0));
        assert_eq!((sight.len(), hold(&sight)), (0, 0.0));
    }
}
