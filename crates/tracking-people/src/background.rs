//! What the static map says about the ends of beams.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::{hypot, sin_cos};
use curionav_planning::occupancy::{Cell, StaticMap};
use nalgebra::{Matrix3, Vector3};

/// Most cells that a beam is traced back from inside of a wall to its face.
const DEEPEST: u32 = 8;

/// A pose that is known so well, ready to be compared with many beams.
pub(crate) struct Posed<'a> {
    map: &'a StaticMap,
    pose: Pose2,
    turn: (f64, f64),
}

/// How the end of a beam lies to the walls of the map.
pub(crate) struct WallDistance {
    /// Metres to the face of the nearest wall, negative inside.
    pub(crate) metres: f64,
    /// What a metre or radian of error of the pose (x, y, heading) changes of it, to first order.
    pub(crate) slope: Vector3<f64>,
}

impl<'a> Posed<'a> {
    pub(crate) fn new(map: &'a StaticMap, pose: Pose2) -> Self {
        Self { map, pose, turn: sin_cos(pose.heading) }
    }

    /// From the robot's frame to the map's.
    pub(crate) fn on_map(&self, end: Point2) -> Point2 {
        let (s, c) = self.turn;
        Point2::new(self.pose.x + c * end.x - s * end.y, self.pose.y + s * end.x + c * end.y)
    }

    /// What the map has where a beam ends, robot frame.
    pub(crate) fn cell(&self, end: Point2) -> Cell {
        self.map.grid.at(self.on_map(end))
    }

    /// Distance from the end of a beam, robot frame, to the face of the nearest wall.
    pub(crate) fn to_wall(&self, end: Point2) -> WallDistance {
        let step = self.map.grid.resolution();
        let p = self.on_map(end);
        let arm = Point2::new(p.x - self.pose.x, p.y - self.pose.y);
        let face = self.face(p, arm);
        let x = (self.field(face, step, 0.0) - self.field(face, -step, 0.0)) / (2.0 * step);
        let y = (self.field(face, 0.0, step) - self.field(face, 0.0, -step)) / (2.0 * step);
        // A beam ends on the face of a cell, the field counts from its centre.
        let metres = self.field(face, 0.0, 0.0) - 0.5 * step + x * (p.x - face.x) + y * (p.y - face.y);
        WallDistance { metres, slope: Vector3::new(x, y, y * arm.x - x * arm.y) }
    }

    /// Where a beam that ends at `p`, `arm` away from the robot, came into the wall: inside of walls the field is flat.
    fn face(&self, p: Point2, arm: Point2) -> Point2 {
        let step = self.map.grid.resolution();
        let length = hypot(arm.x, arm.y).max(step);
        let back_x = -step * arm.x / length;
        let back_y = -step * arm.y / length;
        (0..=DEEPEST)
            .map(|k| Point2::new(p.x + f64::from(k) * back_x, p.y + f64::from(k) * back_y))
            .find(|p| self.map.grid.at(*p) != Cell::Occupied)
            .unwrap_or(p)
    }

    /// Distance to the nearest wall's cell, `dx` and `dy` metres from `p`.
    fn field(&self, p: Point2, dx: f64, dy: f64) -> f64 {
        self.map.to_occupied.between_cells(&self.map.grid, Point2::new(p.x + dx, p.y + dy))
    }
}

impl WallDistance {
    /// Variance of the distance if the pose has this covariance, m2.
    pub(crate) fn variance(&self, covariance: &Matrix3<f64>) -> f64 {
        (self.slope.transpose() * covariance * self.slope)[(0, 0)].max(0.0)
    }
}
