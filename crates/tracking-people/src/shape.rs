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

/// Sums over some points, from which the best line through them follows.
#[derive(Clone, Copy, Default)]
struct Scatter {
    count: f64,
    x: f64,
    y: f64,
    xx: f64,
    xy: f64,
    yy: f64,
}

impl Scatter {
    fn with(self, p: Point2) -> Self {
        Self {
            count: self.count + 1.0,
            x: self.x + p.x,
            y: self.y + p.y,
            xx: self.xx + p.x * p.x,
            xy: self.xy + p.x * p.y,
            yy: self.yy + p.y * p.y,
        }
    }

    fn without(self, other: Self) -> Self {
        Self {
            count: self.count - other.count,
            x: self.x - other.x,
            y: self.y - other.y,
            xx: self.xx - other.xx,
            xy: self.xy - other.xy,
            yy: self.yy - other.yy,
        }
    }

    /// Sum of squared distances from the best line: the lesser eigenvalue of the scatter around the mean.
    fn line(self) -> f64 {
        let xx = self.xx - self.x * self.x / self.count;
        let xy = self.xy - self.x * self.y / self.count;
        let yy = self.yy - self.y * self.y / self.count;
        curionav_planning::numerics::eigenvalues(xx, xy, yy).1.max(0.0)
    }
}

/// The sums over the first points, from none to all, relative to their middle.
fn scatters(points: &[Point2]) -> Vec<Scatter> {
    let m = middle(points);
    let mut all = vec![Scatter::default()];
    for p in points {
        all.push(all[all.len() - 1].with(Point2::new(p.x - m.x, p.y - m.y)));
    }
    all
}

/// Sum of squared distances of points from the best line through them.
fn line(points: &[Point2]) -> f64 {
    let all = scatters(points);
    all[all.len() - 1].line()
}

/// The same for two lines, each through at least `SIDE` of the points.
fn corner(points: &[Point2]) -> f64 {
    let all = scatters(points);
    let whole = all[points.len()];
    let cuts = SIDE..(points.len() + 1).saturating_sub(SIDE);
    cuts.map(|cut| all[cut].line() + whole.without(all[cut]).line()).fold(f64::INFINITY, f64::min)
}

/// Numbers that a circle of known radius has, a line, and two lines that meet anywhere.
const FREE: [f64; 3] = [2.0, 2.0, 5.0];
/// A round thing is so much narrower than a person: a stool, a bin, a pillar.
const THING: f64 = 0.8;
/// Fewest points on a side of a corner.
const SIDE: usize = 3;
/// One scan says no more than that: its points err together.
const MOST_OF_ONE: f64 = 3.0;

/// How likely shapes are, as logarithms and up to a constant, by the criterion of Akaike (1974): no shape gains by
/// having more free numbers.
pub(crate) struct Likelihoods {
    /// The front of a person.
    person: f64,
    /// That of a round thing.
    round: f64,
    /// A side or a corner of a box.
    flat: f64,
}

impl Likelihoods {
    /// Of points that the laser at the origin sees with a standard deviation of `sigma` metres across their shape. A
    /// person is a circle of `radius`.
    pub(crate) fn of(points: &[Point2], radius: f64, sigma: f64) -> Self {
        let person = fit(points, radius);
        let errors = [person.circle, fit(points, THING * radius).circle, person.line, corner(points)];
        let [person, round, side, corner] = errors.map(|error| -0.5 * error / (sigma * sigma));
        let [circle_free, side_free, corner_free] = FREE;
        Self {
            person: person - circle_free,
            round: round - circle_free,
            flat: (side - side_free).max(corner - corner_free),
        }
    }

    /// How much likelier a person is than a round thing.
    pub(crate) fn over_round(&self) -> f64 {
        (self.person - self.round).clamp(-MOST_OF_ONE, MOST_OF_ONE)
    }

    /// How much likelier a person is than a side or a corner of a box.
    pub(crate) fn over_flat(&self) -> f64 {
        (self.person - self.flat).clamp(-MOST_OF_ONE, MOST_OF_ONE)
    }
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
    fn many_noisy_scans_tell_a_person_from_a_side_and_from_a_corner_of_a_box() {
        use curionav_planning::random::{rng, standard_normal};

        const SIGMA: f64 = 0.03;
        let mut random = rng(5, 0);
        let mut sum = |points: &[Point2]| {
            let mut one = || {
                let noisy = points.iter().map(|p| {
                    let range = hypot(p.x, p.y);
                    p.toward(Point2::default(), SIGMA * standard_normal(&mut random) / range)
                });
                let noisy: Vec<Point2> = noisy.collect();
                let likelihoods = Likelihoods::of(&noisy, 0.25, SIGMA);
                likelihoods.over_round().min(likelihoods.over_flat())
            };
            (0..30).map(|_| one()).sum::<f64>()
        };
        let person = front(Point2::new(2.0, 0.2), 0.25);
        let side: Vec<Point2> = (-7..=7).map(|i| Point2::new(2.0, 0.03 * f64::from(i))).collect();
        let corner: Vec<Point2> =
            (-7..=7).map(|i| Point2::new(1.7 + 0.03 * f64::from(i).abs(), 0.03 * f64::from(i))).collect();
        assert!(sum(&person) > 5.0, "{}", sum(&person));
        assert!(sum(&side) < -20.0, "{}", sum(&side));
        let bin = front(Point2::new(2.0, 0.2), 0.19);
        assert!(sum(&bin) < -5.0, "{}", sum(&bin));
        assert!(sum(&corner) < -5.0, "{}", sum(&corner));
    }

    #[test]
    fn a_piece_of_a_wall_is_a_line() {
        let points: Vec<Point2> = (-10..=10).map(|i| Point2::new(2.0, 0.03 * f64::from(i))).collect();
        let fit = fit(&points, 0.25);
        assert!(fit.line < 1e-9 && fit.circle > 0.01, "{} {}", fit.circle, fit.line);
    }
}
