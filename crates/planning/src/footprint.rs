//! Exact distances and collisions of the robot's outline: a disc or a convex polygon at a pose.

use parry2d_f64::math::{Pose, Rotation, Vector};
use parry2d_f64::query::{PointQuery, details::distance_support_map_support_map};
use parry2d_f64::shape::{ConvexPolygon, Cuboid};

use crate::convex_hull::convex_hull;
use crate::geometry::{Point2, Pose2};
use crate::motion::Footprint;
use crate::numerics::sin_cos;
use crate::occupancy::StaticMap;

/// A [`Footprint`] made ready for distance queries. Distances of polygons come from parry's GJK, whose
/// relative error is below 1e-7.
#[derive(Debug, Clone)]
pub struct FootprintShape {
    outline: Outline,
    inscribed: f64,
    circumscribed: f64,
}

#[derive(Debug, Clone)]
enum Outline {
    Disc(f64),
    Polygon(ConvexPolygon),
}

impl From<&Footprint> for FootprintShape {
    /// The convex hull of the vertices, whatever their order, so that a badly listed outline is larger
    /// than meant and never smaller. Without an area (fewer than three vertices off one line) or with a
    /// number that is not finite it is the circumscribed disc, for the same reason.
    fn from(footprint: &Footprint) -> Self {
        let circumscribed = footprint.circumscribed_radius();
        match footprint {
            Footprint::Disc { radius } => Self::disc(*radius),
            Footprint::Polygon { vertices } => {
                if vertices.iter().any(|v| !(v.x.is_finite() && v.y.is_finite())) {
                    return Self::disc(f64::INFINITY);
                }
                let hull = convex_hull(vertices);
                let inscribed = inscribed_radius(&hull);
                let points = hull.iter().map(|v| Vector::new(v.x, v.y)).collect();
                match ConvexPolygon::from_convex_polyline_unmodified(points) {
                    Some(polygon) => Self { outline: Outline::Polygon(polygon), inscribed, circumscribed },
                    None => Self::disc(circumscribed),
                }
            }
        }
    }
}

impl FootprintShape {
    fn disc(radius: f64) -> Self {
        Self { outline: Outline::Disc(radius), inscribed: radius, circumscribed: radius }
    }

    /// Radius of the largest robot-centred disc inside the footprint, metres; 0 when the robot's centre
    /// is not inside.
    pub fn inscribed_radius(&self) -> f64 {
        self.inscribed
    }

    /// Radius of the smallest robot-centred disc that holds the footprint, metres.
    pub fn circumscribed_radius(&self) -> f64 {
        self.circumscribed
    }

    /// Distance from the footprint at `pose` to a point of the same frame, metres; 0 inside. A person is
    /// hit when this is less than the person's radius.
    pub fn distance_to_point(&self, pose: Pose2, point: Point2) -> f64 {
        match &self.outline {
            Outline::Disc(radius) => (pose.position().distance(point) - radius).max(0.0),
            Outline::Polygon(polygon) => {
                let p = pose.inverse_transform(point);
                polygon.distance_to_local_point(Vector::new(p.x, p.y), true)
            }
        }
    }

    /// Whether the footprint at `pose` comes within `margin` metres (not negative) of a cell that is not
    /// known to be free, or of the map's edge.
    pub fn comes_within(&self, pose: Pose2, map: &StaticMap, margin: f64) -> bool {
        let grid = &*map.grid;
        if !(pose.heading.is_finite() && grid.locate(pose.position()).is_some()) {
            return true;
        }
        let half_diagonal = std::f64::consts::FRAC_1_SQRT_2 * grid.resolution();
        // The nearest obstacle's centre is at most half a diagonal farther from us than from our cell's.
        if map.to_obstacle.at(grid, pose.position()) + half_diagonal <= self.inscribed + margin {
            return true;
        }
        let reach = self.circumscribed + margin;
        if grid.to_edge(pose.position()) > reach
            && map.to_obstacle.least_clearance(grid, pose.position()) > reach
        {
            return false;
        }
        self.near_any_cell(pose, map, margin)
    }

    /// The exact check, cell by cell over the footprint's bounding box.
    fn near_any_cell(&self, pose: Pose2, map: &StaticMap, margin: f64) -> bool {
        let grid = &map.grid;
        let at = grid.origin().relative(pose);
        let (low, high) = self.bounds(at);
        let cell = grid.resolution();
        let width = grid.width() as f64 * cell;
        let height = grid.height() as f64 * cell;
        if low.x <= margin || low.y <= margin || high.x >= width - margin || high.y >= height - margin {
            return true;
        }
        // One cell more on each side: distances are compared exactly below, indices are rounded here.
        let first = |least: f64| (((least - margin) / cell).floor() as usize).saturating_sub(1);
        let last = |most: f64, count: usize| (((most + margin) / cell) as usize + 1).min(count - 1);
        for row in first(low.y)..=last(high.y, grid.height()) {
            for column in first(low.x)..=last(high.x, grid.width()) {
                if map.to_obstacle.cell(grid.index(column, row)) > 0.0 {
                    continue;
                }
                let centre = Point2::new((column as f64 + 0.5) * cell, (row as f64 + 0.5) * cell);
                if self.distance_to_square(at, 0.5 * cell, centre) <= margin {
                    return true;
                }
            }
        }
        false
    }

    fn bounds(&self, pose: Pose2) -> (Point2, Point2) {
        match &self.outline {
            Outline::Disc(r) => (Point2::new(pose.x - r, pose.y - r), Point2::new(pose.x + r, pose.y + r)),
            Outline::Polygon(polygon) => {
                let (s, c) = sin_cos(pose.heading);
                let mut low = Point2::new(f64::INFINITY, f64::INFINITY);
                let mut high = Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY);
                for v in polygon.points() {
                    let x = pose.x + c * v.x - s * v.y;
                    let y = pose.y + s * v.x + c * v.y;
                    low = Point2::new(low.x.min(x), low.y.min(y));
                    high = Point2::new(high.x.max(x), high.y.max(y));
                }
                (low, high)
            }
        }
    }

    /// Distance to an axis-aligned square of side `2 * half` around `centre`; 0 when they touch.
    fn distance_to_square(&self, pose: Pose2, half: f64, centre: Point2) -> f64 {
        match &self.outline {
            Outline::Disc(radius) => {
                let dx = ((pose.x - centre.x).abs() - half).max(0.0);
                let dy = ((pose.y - centre.y).abs() - half).max(0.0);
                ((dx * dx + dy * dy).sqrt() - radius).max(0.0)
            }
            Outline::Polygon(polygon) => {
                let (s, c) = sin_cos(pose.heading);
                let rotation = Rotation::from_cos_sin_unchecked(c, s);
                let translation = Vector::new(pose.x - centre.x, pose.y - centre.y);
                let square_from_robot = Pose::from_parts(translation, rotation);
                let square = Cuboid::new(Vector::new(half, half));
                distance_support_map_support_map(&square_from_robot, &square, polygon)
            }
        }
    }
}

/// Least distance from the origin to the polygon's edges, 0 when the origin is not inside.
fn inscribed_radius(hull: &[Point2]) -> f64 {
    let mut least = f64::INFINITY;
    for (i, &a) in hull.iter().enumerate() {
        let b = hull[(i + 1) % hull.len()];
        least = least.min((a.x * b.y - a.y * b.x) / a.distance(b));
    }
    if least.is_finite() { least.max(0.0) } else { 0.0 }
}

#[cfg(test)]
#[path = "footprint_tests.rs"]
mod tests;
