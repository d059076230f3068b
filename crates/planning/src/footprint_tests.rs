use super::*;
use crate::occupancy::{Cell, OccupancyGrid};
use crate::random::{Rng, rng, uniform};

fn between(r: &mut Rng, low: f64, high: f64) -> f64 {
    low + (high - low) * uniform(r)
}

/// Between 3 and 8 vertices on an ellipse around a shifted centre: convex by construction.
fn random_polygon(r: &mut Rng) -> Vec<Point2> {
    let n = 3 + (uniform(r) * 6.0) as usize;
    let a = between(r, 0.2, 0.8);
    let b = between(r, 0.2, 0.8);
    let cx = between(r, -0.3, 0.3);
    let cy = between(r, -0.3, 0.3);
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
    let dx = b.x - a.x;
    let dy = b.y - a.y;
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
    let w = 20 + (uniform(r) * 30.0) as usize;
    let h = 20 + (uniform(r) * 30.0) as usize;
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
    let w = grid.width() as i32;
    let h = grid.height() as i32;
    let ring = 20;
    let mut least = f64::INFINITY;
    for row in -ring..h + ring {
        for column in -ring..w + ring {
            let known = row >= 0 && row < h && column >= 0 && column < w;
            if known && grid.cell(grid.index(column as usize, row as usize)) == Cell::Free {
                continue;
            }
            let corner = |i: i32, j: i32| {
                grid.origin().transform(Point2::new(f64::from(column + i) * 0.1, f64::from(row + j) * 0.1))
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
        let pose = random_pose(&mut r, 3.0);
        let p = random_pose(&mut r, 3.0).position();
        let found = shape.distance_to_point(pose, p);
        let expected = plain_distance(&footprint, pose, p);
        assert!((found - expected).abs() < 1e-7, "case {case}: {found} for {expected}, {footprint:?}");
    }
}

#[test]
fn grid_collisions_equal_brute_force_on_rotated_maps() {
    let mut hits = 0;
    let mut near = 0;
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
                assert_eq!(shape.comes_within(pose, &map, 0.0), clearance == 0.0, "{context}");
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
        vertices: [(-0.2, -0.3), (1.0, -0.3), (1.0, 0.3), (-0.2, 0.3)].map(|(x, y)| Point2::new(x, y)).into(),
    };
    let shape = FootprintShape::from(&long);
    // the nose is 1.0 m ahead of the centre, the map ends at x = 5
    assert!(!shape.comes_within(Pose2::new(3.9, 2.5, 0.0), &map, 0.0));
    assert!(shape.comes_within(Pose2::new(4.1, 2.5, 0.0), &map, 0.0));
    assert!(!shape.comes_within(Pose2::new(4.1, 2.5, 1.6), &map, 0.0), "turned along the edge it fits");
    assert!(shape.comes_within(Pose2::new(9.0, 9.0, 0.0), &map, 0.0));
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
