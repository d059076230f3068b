//! Exact distances and collisions of the robot's outline: a disc or a convex polygon at a pose.

use parry2d_f64::math::{Pose, Rotation, Vector};
use parry2d_f64::query::{PointQuery, details::distance_support_map_support_map};
use parry2d_f64::shape::{ConvexPolygon, Cuboid, SupportMap};

use crate::geometry::{Point2, Pose2};
use crate::motion::Footprint;
use crate::numerics::sin_cos;
use crate::occupancy::{Cell, OccupancyGrid, StaticMap};

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

    /// Whether the footprint at `pose` touches a cell that is not known to be free, or leaves the map.
    pub fn collides_grid(&self, pose: Pose2, map: &StaticMap) -> bool {
        self.comes_within(pose, map, 0.0)
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
        let (column, row) = grid.grid_from_map(pose.position());
        let (width, height) = (grid.width() as f64, grid.height() as f64);
        let to_edge = column.min(width - column).min(row).min(height - row) * grid.resolution();
        if to_edge > reach && map.to_obstacle.clearance(grid, pose.position()) > reach {
            return false;
        }
        self.near_any_cell(pose, grid, margin)
    }

    /// The exact check, cell by cell over the footprint's bounding box.
    fn near_any_cell(&self, pose: Pose2, grid: &OccupancyGrid, margin: f64) -> bool {
        let at = grid.origin().relative(pose);
        let (low, high) = self.bounds(at);
        let cell = grid.resolution();
        let (width, height) = (grid.width() as f64 * cell, grid.height() as f64 * cell);
        if low.x <= margin || low.y <= margin || high.x >= width - margin || high.y >= height - margin {
            return true;
        }
        // One cell more on each side: distances are compared exactly below, indices are rounded here.
        let first = |least: f64| (((least - margin) / cell).floor() as usize).saturating_sub(1);
        let last = |most: f64, count: usize| (((most + margin) / cell) as usize + 1).min(count - 1);
        let square = Square { half: 0.5 * cell };
        for row in first(low.y)..=last(high.y, grid.height()) {
            for column in first(low.x)..=last(high.x, grid.width()) {
                if grid.cell(grid.index(column, row)) == Cell::Free {
                    continue;
                }
                let centre = Point2::new((column as f64 + 0.5) * cell, (row as f64 + 0.5) * cell);
                if self.distance_to_square(at, &square, centre) <= margin {
                    return true;
                }
            }
        }
        false
    }

    /// Axis-aligned bounding box at `pose`.
    fn bounds(&self, pose: Pose2) -> (Point2, Point2) {
        match &self.outline {
            Outline::Disc(r) => (Point2::new(pose.x - r, pose.y - r), Point2::new(pose.x + r, pose.y + r)),
            Outline::Polygon(polygon) => {
                let (s, c) = sin_cos(pose.heading);
                let mut low = Point2::new(f64::INFINITY, f64::INFINITY);
                let mut high = Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY);
                for v in polygon.points() {
                    let (x, y) = (pose.x + c * v.x - s * v.y, pose.y + s * v.x + c * v.y);
                    low = Point2::new(low.x.min(x), low.y.min(y));
                    high = Point2::new(high.x.max(x), high.y.max(y));
                }
                (low, high)
            }
        }
    }

    /// Distance to an axis-aligned square around `centre`; 0 when they touch.
    fn distance_to_square(&self, pose: Pose2, square: &Square, centre: Point2) -> f64 {
        match &self.outline {
            Outline::Disc(radius) => {
                let dx = ((pose.x - centre.x).abs() - square.half).max(0.0);
                let dy = ((pose.y - centre.y).abs() - square.half).max(0.0);
                ((dx * dx + dy * dy).sqrt() - radius).max(0.0)
            }
            Outline::Polygon(polygon) => {
                let (s, c) = sin_cos(pose.heading);
                let rotation = Rotation::from_cos_sin_unchecked(c, s);
                let translation = Vector::new(pose.x - centre.x, pose.y - centre.y);
                let square_from_robot = Pose::from_parts(translation, rotation);
                let square = Cuboid::new(Vector::new(square.half, square.half));
                separation(&square_from_robot, &square, polygon)
            }
        }
    }
}

/// An axis-aligned square of side `2 * half`, metres.
struct Square {
    half: f64,
}

/// Distance between two convex shapes, the second posed in the frame of the first.
fn separation(first_from_second: &Pose, first: &impl SupportMap, second: &impl SupportMap) -> f64 {
    distance_support_map_support_map(first_from_second, first, second)
}

/// Convex hull, counter-clockwise, without vertices inside an edge (Andrew's monotone chain).
fn convex_hull(vertices: &[Point2]) -> Vec<Point2> {
    let mut sorted = vertices.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
    let turns_left =
        |o: Point2, a: Point2, b: Point2| (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x) > 0.0;
    let mut hull: Vec<Point2> = Vec::with_capacity(sorted.len() + 1);
    for pass in 0..2 {
        let start = hull.len();
        for &p in &sorted {
            while hull.len() >= start + 2 && !turns_left(hull[hull.len() - 2], hull[hull.len() - 1], p) {
                hull.pop();
            }
            hull.push(p);
        }
        hull.pop();
        if pass == 0 {
            sorted.reverse();
        }
    }
    hull
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
mod tests {
    use super::*;
    use crate::random::{Rng, rng, uniform};

    fn between(r: &mut Rng, low: f64, high: f64) -> f64 {
        low + (high - low) * uniform(r)
    }

    /// Between 3 and 8 vertices on an ellipse around a shifted centre: convex by construction.
    fn random_polygon(r: &mut Rng) -> Vec<Point2> {
        let n = 3 + (uniform(r) * 6.0) as usize;
        let (a, b) = (between(r, 0.2, 0.8), between(r, 0.2, 0.8));
        let (cx, cy) = (between(r, -0.3, 0.3), between(r, -0.3, 0.3));
        let mut angles: Vec<f64> = (0..n).map(|_| between(r, 0.0, std::f64::consts::TAU)).collect();
        angles.sort_by(f64::total_cmp);
        angles.iter().map(|t| Point2::new(cx + a * t.cos(), cy + b * t.sin())).collect()
    }

    fn random_shape(r: &mut Rng) -> (Footprint, FootprintShape) {
        let footprint = if uniform(r) < 0.2 {
            Footprint::Disc { radius: between(r, 0.1, 0.6) }
        } else {
            Footprint::Polygon { vertices: random_polygon(r) }
        };
        let shape = FootprintShape::from(&footprint);
        (footprint, shape)
    }

    fn random_pose(r: &mut Rng, side: f64) -> Pose2 {
        Pose2::new(between(r, 0.0, side), between(r, 0.0, side), between(r, -4.0, 4.0))
    }

    fn segment_distance(p: Point2, a: Point2, b: Point2) -> f64 {
        let (dx, dy) = (b.x - a.x, b.y - a.y);
        let t = (((p.x - a.x) * dx + (p.y - a.y) * dy) / (dx * dx + dy * dy)).clamp(0.0, 1.0);
        p.distance(Point2::new(a.x + t * dx, a.y + t * dy))
    }

    fn edges(corners: &[Point2]) -> impl Iterator<Item = (Point2, Point2)> + '_ {
        (0..corners.len()).map(|i| (corners[i], corners[(i + 1) % corners.len()]))
    }

    fn inside(p: Point2, corners: &[Point2]) -> bool {
        edges(corners).all(|(a, b)| (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x) >= 0.0)
    }

    fn plain_distance(footprint: &Footprint, pose: Pose2, p: Point2) -> f64 {
        match footprint {
            Footprint::Disc { radius } => (pose.position().distance(p) - radius).max(0.0),
            Footprint::Polygon { vertices } => {
                let corners: Vec<Point2> = vertices.iter().map(|&v| pose.transform(v)).collect();
                if inside(p, &corners) {
                    return 0.0;
                }
                edges(&corners).map(|(a, b)| segment_distance(p, a, b)).fold(f64::INFINITY, f64::min)
            }
        }
    }

    /// Distance between the footprint and a square given by its corners in the map frame.
    fn plain_square_distance(footprint: &Footprint, pose: Pose2, square: &[Point2]) -> f64 {
        let Footprint::Polygon { vertices } = footprint else {
            let Footprint::Disc { radius } = footprint else { unreachable!() };
            if inside(pose.position(), square) {
                return 0.0;
            }
            let d = edges(square).map(|(a, b)| segment_distance(pose.position(), a, b));
            return (d.fold(f64::INFINITY, f64::min) - radius).max(0.0);
        };
        let corners: Vec<Point2> = vertices.iter().map(|&v| pose.transform(v)).collect();
        let side = |a: Point2, b: Point2, p: Point2| (b.x - a.x) * (p.y - a.y) - (b.y - a.y) * (p.x - a.x);
        let crosses = edges(&corners).any(|(a, b)| {
            edges(square)
                .any(|(c, d)| side(a, b, c) * side(a, b, d) <= 0.0 && side(c, d, a) * side(c, d, b) <= 0.0)
        });
        if crosses || inside(corners[0], square) || inside(square[0], &corners) {
            return 0.0;
        }
        let there = square.iter().map(|&p| plain_distance(footprint, pose, p));
        let back = corners.iter().flat_map(|&p| edges(square).map(move |(a, b)| segment_distance(p, a, b)));
        there.chain(back).fold(f64::INFINITY, f64::min)
    }

    fn random_map(r: &mut Rng) -> StaticMap {
        let (w, h) = (20 + (uniform(r) * 30.0) as usize, 20 + (uniform(r) * 30.0) as usize);
        let share = 0.01 * uniform(r);
        let origin = Pose2::new(between(r, -3.0, 3.0), between(r, -3.0, 3.0), between(r, -4.0, 4.0));
        let cells = (0..w * h).map(|_| match uniform(r) {
            u if u < share => 100,
            u if u < 1.2 * share => -1,
            _ => 0,
        });
        StaticMap::new(OccupancyGrid::new(w, h, 0.1, origin, cells.collect()).unwrap())
    }

    /// Distance to the nearest cell that is not free, in the map or in a ring of 2 m around it.
    fn plain_clearance(footprint: &Footprint, pose: Pose2, grid: &OccupancyGrid) -> f64 {
        let (w, h, ring) = (grid.width() as i32, grid.height() as i32, 20);
        let mut least = f64::INFINITY;
        for row in -ring..h + ring {
            for column in -ring..w + ring {
                let known = row >= 0 && row < h && column >= 0 && column < w;
                if known && grid.cell(grid.index(column as usize, row as usize)) == Cell::Free {
                    continue;
                }
                let corner = |i: i32, j: i32| {
                    grid.origin()
                        .transform(Point2::new(f64::from(column + i) * 0.1, f64::from(row + j) * 0.1))
                };
                let square = [corner(0, 0), corner(1, 0), corner(1, 1), corner(0, 1)];
                if pose.position().distance(square[0]) < 3.0 {
                    least = least.min(plain_square_distance(footprint, pose, &square));
                }
            }
        }
        least
    }

    #[test]
    fn distance_to_a_point_equals_brute_force() {
        let mut r = rng(1, 0);
        for case in 0..20_000 {
            let (footprint, shape) = random_shape(&mut r);
            let (pose, p) = (random_pose(&mut r, 3.0), random_pose(&mut r, 3.0).position());
            let (found, expected) = (shape.distance_to_point(pose, p), plain_distance(&footprint, pose, p));
            assert!((found - expected).abs() < 1e-7, "case {case}: {found} for {expected}, {footprint:?}");
        }
    }

    #[test]
    fn grid_collisions_equal_brute_force_on_rotated_maps() {
        let (mut hits, mut near) = (0, 0);
        for seed in 0..60 {
            let mut r = rng(seed, 1);
            let map = random_map(&mut r);
            for _ in 0..10 {
                let (footprint, shape) = random_shape(&mut r);
                let local = random_pose(&mut r, 0.1 * map.grid.width().min(map.grid.height()) as f64);
                let pose = map.grid.origin().compose(local);
                let clearance = plain_clearance(&footprint, pose, &map.grid);
                let margin = between(&mut r, 0.0, 0.3);
                let context = format!("seed {seed}, {footprint:?} at {pose:?}, clearance {clearance}");
                if clearance == 0.0 || clearance > 1e-6 {
                    assert_eq!(shape.collides_grid(pose, &map), clearance == 0.0, "{context}");
                }
                if (clearance - margin).abs() > 1e-6 {
                    assert_eq!(shape.comes_within(pose, &map, margin), clearance < margin, "{context}");
                }
                hits += usize::from(clearance == 0.0);
                near += usize::from(clearance > 0.0 && clearance < margin);
            }
        }
        assert!(hits > 100 && hits < 500 && near > 20, "a test that sees both answers: {hits}, {near}");
    }

    #[test]
    fn leaving_the_map_is_a_collision() {
        let grid = OccupancyGrid::new(50, 50, 0.1, Pose2::default(), vec![0; 2500]).unwrap();
        let map = StaticMap::new(grid);
        let long = Footprint::Polygon {
            vertices: [(-0.2, -0.3), (1.0, -0.3), (1.0, 0.3), (-0.2, 0.3)]
                .map(|(x, y)| Point2::new(x, y))
                .into(),
        };
        let shape = FootprintShape::from(&long);
        // the nose is 1.0 m ahead of the centre, the map ends at x = 5
        assert!(!shape.collides_grid(Pose2::new(3.9, 2.5, 0.0), &map));
        assert!(shape.collides_grid(Pose2::new(4.1, 2.5, 0.0), &map));
        assert!(!shape.collides_grid(Pose2::new(4.1, 2.5, 1.6), &map), "turned along the edge it fits");
        assert!(shape.collides_grid(Pose2::new(9.0, 9.0, 0.0), &map));
    }

    #[test]
    fn a_badly_listed_outline_is_never_smaller_than_meant() {
        let clockwise_with_a_dent = Footprint::Polygon {
            vertices: [(-0.5, -0.5), (-0.5, 0.5), (0.0, 0.1), (0.5, 0.5), (0.5, -0.5), (0.5, -0.5)]
                .map(|(x, y)| Point2::new(x, y))
                .into(),
        };
        let shape = FootprintShape::from(&clockwise_with_a_dent);
        assert_eq!(shape.distance_to_point(Pose2::default(), Point2::new(0.0, 0.3)), 0.0);
        assert!((shape.distance_to_point(Pose2::default(), Point2::new(0.8, 0.9)) - 0.5).abs() < 1e-7);
        assert!((shape.inscribed_radius() - 0.5).abs() < 1e-12);
        let line = Footprint::Polygon { vertices: vec![Point2::new(-0.3, 0.0), Point2::new(0.4, 0.0)] };
        let shape = FootprintShape::from(&line);
        assert!((shape.distance_to_point(Pose2::default(), Point2::new(0.0, 1.0)) - 0.6).abs() < 1e-12);
    }
}
