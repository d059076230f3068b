//! What a run of beams may have ended on.

use curionav_planning::geometry::Point2;
use curionav_planning::numerics::hypot;

/// A circle of known radius fitted to points that the laser at the origin sees of it, and how well it and a straight
/// line fit: sums of squares, m2.
pub(crate) struct Fit {
    pub(crate) centre: Point2,
    pub(crate) circle: f64,
    pub(crate) line: f64,
}

/// Steps of Gauss and Newton.
const STEPS: usize = 6;
/// The mean of what is seen of a circle lies this share of its radius before its centre: pi / 4, for beams that are
/// spread evenly across it.
const FRONT: f64 = std::f64::consts::FRAC_PI_4;
/// Pulls the centre to where it is for a circle that is seen as a whole, as so many points would: the ends of a short
/// arc say little across the line of sight.
const PULL: f64 = 0.5;

/// The middle of some points.
pub(crate) fn middle(points: &[Point2]) -> Point2 {
    let n = points.len() as f64;
    let x = points.iter().map(|p| p.x).sum::<f64>() / n;
    let y = points.iter().map(|p| p.y).sum::<f64>() / n;
    Point2::new(x, y)
}

/// The centre of a circle of `radius`, which lies behind the `middle` of what the laser sees of it.
pub(crate) fn centre_behind(middle: Point2, radius: f64) -> Point2 {
    let distance = hypot(middle.x, middle.y).max(1e-6);
    middle.toward(Point2::default(), -FRONT * radius / distance)
}

/// Fits a circle of `radius`, laser frame.
pub(crate) fn fit(points: &[Point2], radius: f64) -> Fit {
    let start = centre_behind(middle(points), radius);
    let mut centre = start;
    for _ in 0..STEPS {
        // The normal equations: a b c are the symmetric matrix, x y the right-hand side.
        let mut a = PULL;
        let mut b = 0.0;
        let mut c = PULL;
        let mut x = PULL * (start.x - centre.x);
        let mut y = PULL * (start.y - centre.y);
        for p in points {
            let distance = p.distance(centre).max(1e-6);
            let nx = (p.x - centre.x) / distance;
            let ny = (p.y - centre.y) / distance;
            let off = distance - radius;
            a += nx * nx;
            b += nx * ny;
            c += ny * ny;
            x += nx * off;
            y += ny * off;
        }
        let determinant = a * c - b * b;
        if determinant <= 1e-12 {
            break;
        }
        centre =
            Point2::new(centre.x + (c * x - b * y) / determinant, centre.y + (a * y - b * x) / determinant);
    }
    let off = points.iter().map(|p| p.distance(centre) - radius);
    Fit { centre, circle: off.map(|off| off * off).sum(), line: line(points) }
}

/// Sum of squared distances from the best line: the lesser eigenvalue of the scatter.
fn line(points: &[Point2]) -> f64 {
    let m = middle(points);
    let mut xx = 0.0;
    let mut xy = 0.0;
    let mut yy = 0.0;
    for p in points {
        let dx = p.x - m.x;
        let dy = p.y - m.y;
        xx += dx * dx;
        xy += dx * dy;
        yy += dy * dy;
    }
    curionav_planning::numerics::eigenvalues(xx, xy, yy).1.max(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::numerics::sin_cos;

    /// What a laser with a beam every degree sees of a disc.
    fn front(centre: Point2, radius: f64) -> Vec<Point2> {
        (-90..=90)
            .filter_map(|i| {
                let (s, c) = sin_cos(f64::from(i).to_radians());
                let along = centre.x * c + centre.y * s;
                let inside = along * along - centre.distance_squared(Point2::default()) + radius * radius;
                (inside >= 0.0).then(|| {
                    let range = along - inside.sqrt();
                    Point2::new(range * c, range * s)
                })
            })
            .collect()
    }

    #[test]
    fn a_disc_is_found_where_it_is_and_is_no_line() {
        for centre in [Point2::new(2.0, 0.3), Point2::new(0.8, -1.2), Point2::new(4.0, 1.0)] {
            let points = front(centre, 0.25);
            let fit = fit(&points, 0.25);
            assert!(fit.centre.distance(centre) < 0.02, "{:?} for {centre:?}", fit.centre);
            assert!(fit.circle < 0.2 * fit.line, "{} {}", fit.circle, fit.line);
        }
    }

    #[test]
    fn a_piece_of_a_wall_is_a_line() {
        let points: Vec<Point2> = (-10..=10).map(|i| Point2::new(2.0, 0.03 * f64::from(i))).collect();
        let fit = fit(&points, 0.25);
        assert!(fit.line < 1e-9 && fit.circle > 0.01, "{} {}", fit.circle, fit.line);
    }
}
