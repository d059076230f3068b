//! The smallest circle around a set of points: C(.) and R(.) of eq. 17 (A18).
//!
//! A pivoting solution of the LP-type problem of Welzl (1991) and Gärtner (1999): the circle of at most
//! three support points is replaced by the one that also holds the farthest point, until none is
//! outside. The radius grows with every pivot, so it ends; the order of the points is used as it is.

use crate::geometry::Point2;

/// Pivots after which the circle is taken as it is. Random and cocircular sets need about ten; the limit
/// is there so that rounding can never make the loop endless. The result encloses all points even then.
const MAX_PIVOTS: usize = 1000;

/// A circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Circle {
    /// Centre, in the frame of the points.
    pub centre: Point2,
    /// Metres, not negative.
    pub radius: f64,
}

/// The smallest circle that holds every point; none when there is no point. One point gives radius 0,
/// two the circle over their midpoint. The radius is the greatest distance from the centre to a point,
/// so no point lies outside by more than the rounding of that distance.
pub fn smallest_enclosing_circle(points: &[Point2]) -> Option<Circle> {
    let mut support = Support { points: [*points.first()?; 3], count: 1 };
    let mut centre = points[0];
    let mut radius_squared = 0.0;
    for _ in 0..MAX_PIVOTS {
        let (far, distance_squared) = farthest(centre, points);
        if distance_squared <= radius_squared * (1.0 + 8.0 * f64::EPSILON) {
            break;
        }
        let (next_support, next_centre, next_squared) = support.with(far);
        if next_squared <= radius_squared {
            break;
        }
        (support, centre, radius_squared) = (next_support, next_centre, next_squared);
    }
    Some(Circle { centre, radius: farthest(centre, points).1.sqrt() })
}

/// The point farthest from `centre` (the first of equals) and its squared distance.
fn farthest(centre: Point2, points: &[Point2]) -> (Point2, f64) {
    let mut best = (centre, 0.0);
    for &p in points {
        let d = centre.distance_squared(p);
        if d > best.1 {
            best = (p, d);
        }
    }
    best
}

/// One to three points that alone determine a smallest enclosing circle.
#[derive(Debug, Clone, Copy)]
struct Support {
    points: [Point2; 3],
    count: usize,
}

impl Support {
    /// Support, centre and squared radius of the smallest circle around these points and `p`, which lies
    /// outside the present circle and hence on the new one. Of all centres given by `p` and one or two
    /// others the right one has the least greatest distance: no tolerance is needed to find it.
    fn with(&self, p: Point2) -> (Self, Point2, f64) {
        let old = &self.points[..self.count];
        let mut best = (*self, p, f64::INFINITY);
        let mut consider = |support: Self, centre: Point2| {
            let cover = farthest(centre, old).1.max(centre.distance_squared(p));
            if cover < best.2 {
                best = (support, centre, cover);
            }
        };
        for (i, &a) in old.iter().enumerate() {
            let middle = Point2::new(0.5 * (p.x + a.x), 0.5 * (p.y + a.y));
            consider(Self { points: [p, a, a], count: 2 }, middle);
            for &b in &old[i + 1..] {
                if let Some(centre) = circumcentre(p, a, b) {
                    consider(Self { points: [p, a, b], count: 3 }, centre);
                }
            }
        }
        best
    }
}

/// The point as far from `a` as from `b` and `c`; none when they lie on a line.
fn circumcentre(a: Point2, b: Point2, c: Point2) -> Option<Point2> {
    let bx = b.x - a.x;
    let by = b.y - a.y;
    let cx = c.x - a.x;
    let cy = c.y - a.y;
    let twice_area = 2.0 * (bx * cy - by * cx);
    let b2 = bx * bx + by * by;
    let c2 = cx * cx + cy * cy;
    let centre = Point2::new(a.x + (cy * b2 - by * c2) / twice_area, a.y + (bx * c2 - cx * b2) / twice_area);
    (centre.x.is_finite() && centre.y.is_finite()).then_some(centre)
}

#[cfg(test)]
pub(crate) mod tests {
    use curionav_testing::reference_data;

    use super::*;
    use crate::random::{rng, uniform};

    /// The slow reference: every circle over two or three of the points, the smallest that holds them all.
    pub(crate) fn brute_force_circle(points: &[Point2]) -> Circle {
        let mut best = Circle { centre: points[0], radius: f64::INFINITY };
        let mut consider = |centre: Point2| {
            let radius = points.iter().map(|p| p.distance(centre)).fold(0.0, f64::max);
            if radius < best.radius {
                best = Circle { centre, radius };
            }
        };
        for (i, &a) in points.iter().enumerate() {
            consider(a);
            for (j, &b) in points.iter().enumerate().skip(i + 1) {
                consider(Point2::new(0.5 * (a.x + b.x), 0.5 * (a.y + b.y)));
                for &c in &points[j + 1..] {
                    if let Some(centre) = circumcentre(a, b, c) {
                        consider(centre);
                    }
                }
            }
        }
        best
    }

    #[test]
    fn equals_brute_force_on_random_and_on_nasty_sets() {
        for seed in 0..3000 {
            let mut r = rng(seed, 2);
            let n = 1 + (uniform(&mut r) * 12.0) as usize;
            let scale = [1.0, 1e-6, 1e6][(seed % 3) as usize];
            let offset = if seed % 5 == 0 { 1e3 * scale } else { 0.0 };
            let points: Vec<Point2> = (0..n)
                .map(|_| match seed % 4 {
                    // a coarse lattice: duplicates, collinear and cocircular points
                    0 => ((uniform(&mut r) * 4.0).floor(), (uniform(&mut r) * 4.0).floor()),
                    1 => (uniform(&mut r), 0.0),
                    _ => (uniform(&mut r), uniform(&mut r)),
                })
                .map(|(x, y)| Point2::new(offset + scale * x, offset + scale * y))
                .collect();
            let fast = smallest_enclosing_circle(&points).unwrap();
            let slow = brute_force_circle(&points);
            let tolerance = 1e-12 * (offset + 4.0 * scale);
            assert!((fast.radius - slow.radius).abs() <= tolerance, "seed {seed}: {fast:?}, {slow:?}");
            // the radius is flat around the best centre: it fixes the centre to the root of the rounding
            assert!(fast.centre.distance(slow.centre) <= 1e-6 * (offset + 4.0 * scale), "seed {seed}");
        }
    }

    #[test]
    fn no_point_is_left_outside_a_thousand() {
        for seed in 0..20 {
            let mut r = rng(seed, 3);
            let points: Vec<Point2> =
                (0..1024).map(|_| Point2::new(30.0 * uniform(&mut r), 30.0 * uniform(&mut r))).collect();
            let circle = smallest_enclosing_circle(&points).unwrap();
            assert!(points.iter().all(|p| p.distance(circle.centre) <= circle.radius));
        }
    }

    #[test]
    fn one_point_has_radius_zero_and_two_their_midpoint() {
        let a = Point2::new(1.0, 2.0);
        let b = Point2::new(4.0, 6.0);
        assert_eq!(smallest_enclosing_circle(&[]), None);
        assert_eq!(smallest_enclosing_circle(&[a, a, a]), Some(Circle { centre: a, radius: 0.0 }));
        let middle = Circle { centre: Point2::new(2.5, 4.0), radius: 2.5 };
        assert_eq!(smallest_enclosing_circle(&[a, b]), Some(middle));
    }

    /// Answers from the unit tests of 123jimin/ckp (BOJ problems 2389 and 21182) and of G. van Tulder's smallestCircle.
    #[test]
    fn published_cases_come_out_as_published() {
        let half = std::f64::consts::FRAC_1_SQRT_2;
        let contest = [
            (435.249, -539.356),
            (455.823, -539.257),
            (423.394, -538.858),
            (446.507, -539.37),
            (434.266, -560.631),
            (445.059, -537.501),
            (449.65, -513.778),
            (456.05, -561.329),
        ];
        type Case<'a> = (&'a [(f64, f64)], f64, Option<(f64, f64)>);
        let cases: [Case<'_>; 10] = [
            (&[(1.0, 1.0), (2.0, 2.0), (3.0, 3.0)], std::f64::consts::SQRT_2, Some((2.0, 2.0))),
            (&[(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0)], 1.0, None),
            (&[(1.0, 1.4), (-1.0, -1.4), (0.0, -0.2)], 1.720_465_053_408_525_3, None),
            (&[(0.0, 1.4), (0.0, -1.4), (1.0, -0.2)], 1.4, None),
            (&contest, 24.999_914_659_9, None),
            (&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)], half, Some((0.5, 0.5))),
            (&[(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0), (0.2, 0.5)], half, Some((0.5, 0.5))),
            (&[(-1.0, 0.0), (0.0, -1.0), (1.0, 0.0), (0.0, 1.0)], 1.0, Some((0.0, 0.0))),
            (&[(-1.0, 2.0)], 0.0, Some((-1.0, 2.0))),
            (&[(-1.0, 2.0), (0.0, 2.0)], 0.5, Some((-0.5, 2.0))),
        ];
        for (points, radius, centre) in cases {
            let points: Vec<Point2> = points.iter().map(|&(x, y)| Point2::new(x, y)).collect();
            let circle = smallest_enclosing_circle(&points).unwrap();
            // answers are printed with as few as twelve digits
            assert!((circle.radius - radius).abs() <= 1e-11 * radius, "{points:?}: {circle:?}");
            if let Some((x, y)) = centre {
                assert!(circle.centre.distance(Point2::new(x, y)) < 1e-9, "{points:?}: {circle:?}");
            }
        }
    }

    #[test]
    fn thousands_of_cocircular_points_do_not_confuse_it() {
        let file = "ref_enclosing_circle/cocircular_points_small_radius_2.data";
        let Some(path) = reference_data(file) else { return };
        let points: Vec<Point2> = std::fs::read_to_string(path)
            .unwrap()
            .lines()
            .skip(1)
            .filter(|line| !line.starts_with("//") && !line.trim().is_empty())
            .map(|line| {
                let mut numbers = line.split_whitespace().map(|n| n.parse().unwrap());
                Point2::new(numbers.next().unwrap(), numbers.next().unwrap())
            })
            .collect();
        assert_eq!(points.len(), 6144);
        let circle = smallest_enclosing_circle(&points).unwrap();
        assert!((circle.radius * circle.radius / 3.728702916375125e15 - 1.0).abs() < 1e-12, "{circle:?}");
        assert!(circle.centre.distance(Point2::default()) < 1e-12 * circle.radius, "{circle:?}");
    }
}
