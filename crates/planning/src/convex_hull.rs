//! The convex hull of points in the plane, and how far other points are from it.

use crate::geometry::Point2;

/// Convex hull, counter-clockwise, without vertices inside an edge (Andrew's monotone chain). Of points on one line it
/// has the two ends, of one point that point.
pub(crate) fn convex_hull(points: &[Point2]) -> Vec<Point2> {
    let mut sorted = points.to_vec();
    sorted.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    sorted.dedup();
    if sorted.len() < 3 {
        return sorted;
    }
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

fn turns_left(o: Point2, a: Point2, b: Point2) -> bool {
    cross(o, a, b) > 0.0
}

/// Twice the area of the triangle, positive if its corners are counter-clockwise.
fn cross(o: Point2, a: Point2, b: Point2) -> f64 {
    (a.x - o.x) * (b.y - o.y) - (a.y - o.y) * (b.x - o.x)
}

/// The edges of a hull, from each vertex to the next. A hull of two has one there and one back.
pub(crate) fn edges(hull: &[Point2]) -> impl Iterator<Item = (Point2, Point2)> {
    hull.iter().copied().zip(hull.iter().copied().cycle().skip(1))
}

/// Area of a hull, m2.
pub(crate) fn area(hull: &[Point2]) -> f64 {
    let Some(&corner) = hull.first() else { return 0.0 };
    0.5 * edges(hull).map(|(a, b)| cross(corner, a, b)).sum::<f64>()
}

/// Length of the way around a hull, metres.
pub(crate) fn perimeter(hull: &[Point2]) -> f64 {
    edges(hull).map(|(a, b)| a.distance(b)).sum()
}

/// Squared distance of a point from a hull, m2: 0 inside, infinite without any vertices.
pub(crate) fn distance_squared(hull: &[Point2], p: Point2) -> f64 {
    let mut nearest = f64::INFINITY;
    let mut least_cross = f64::INFINITY;
    for (a, b) in edges(hull) {
        least_cross = least_cross.min(cross(a, b, p));
        let length_squared = a.distance_squared(b);
        let along = (p.x - a.x) * (b.x - a.x) + (p.y - a.y) * (b.y - a.y);
        let share = if length_squared > 0.0 { (along / length_squared).clamp(0.0, 1.0) } else { 0.0 };
        nearest = nearest.min(a.toward(b, share).distance_squared(p));
    }
    let is_inside = least_cross > 0.0 && least_cross.is_finite();
    if is_inside { 0.0 } else { nearest }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{rng, uniform};

    #[test]
    fn a_hull_holds_its_points_and_a_point_outside_is_as_far_as_a_fine_walk_around_it_says() {
        for seed in 0..200 {
            let mut r = rng(seed, 60);
            let count = 1 + (uniform(&mut r) * 9.0) as usize;
            let points: Vec<Point2> =
                (0..count).map(|_| Point2::new(4.0 * uniform(&mut r), 4.0 * uniform(&mut r))).collect();
            let hull = convex_hull(&points);
            for &p in &points {
                assert!(distance_squared(&hull, p) < 1e-20, "seed {seed}: {p:?}");
            }
            let p = Point2::new(12.0 * uniform(&mut r) - 4.0, 12.0 * uniform(&mut r) - 4.0);
            let found = distance_squared(&hull, p).sqrt();
            let around =
                edges(&hull).flat_map(|(a, b)| (0..=1000).map(move |k| a.toward(b, 0.001 * f64::from(k))));
            let walked = around.map(|q| q.distance(p)).fold(f64::INFINITY, f64::min);
            let is_inside = hull.len() > 2 && edges(&hull).all(|(a, b)| cross(a, b, p) > 0.0);
            let expected = if is_inside { 0.0 } else { walked };
            assert!((found - expected).abs() < 0.01, "seed {seed}: {found}, not {expected}");
        }
    }

    #[test]
    fn a_square_a_line_and_a_point_have_the_measures_of_the_textbook() {
        let square = [(0.0, 0.0), (2.0, 0.0), (2.0, 2.0), (0.0, 2.0), (1.0, 1.0), (1.0, 0.0)];
        let points: Vec<Point2> = square.iter().map(|&(x, y)| Point2::new(x, y)).collect();
        let hull = convex_hull(&points);
        assert_eq!((hull.len(), area(&hull), perimeter(&hull)), (4, 4.0, 8.0));
        let line = convex_hull(&points[..2]);
        assert_eq!((line.len(), area(&line), perimeter(&line)), (2, 0.0, 4.0));
        // Beyond its end, on the same line.
        assert_eq!(distance_squared(&line, Point2::new(5.0, 0.0)), 9.0);
        let point = convex_hull(&points[..1]);
        assert_eq!((area(&point), perimeter(&point)), (0.0, 0.0));
        assert_eq!(distance_squared(&point, Point2::new(3.0, 4.0)), 25.0);
        assert_eq!(distance_squared(&[], Point2::default()), f64::INFINITY);
    }
}
