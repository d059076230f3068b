//! A geometric path: a polyline with even spacing, followed by arc length.

use crate::geometry::Point2;

/// Points every [`Path::SPACING`] metres along a polyline; at least one point.
#[derive(Debug, Clone, PartialEq)]
pub struct Path {
    points: Vec<Point2>,
}

/// Points that room is made for at once: those of most paths.
const USUAL: usize = 64;

impl Path {
    /// Metres between points.
    pub const SPACING: f64 = 0.1;

    /// The polyline that starts at `start` and goes through `points`, cut at `limit` metres. What is
    /// left at the end that is shorter than the spacing is dropped.
    pub fn new(start: Point2, points: impl IntoIterator<Item = Point2>, limit: f64) -> Self {
        let mut path = Self { points: vec![start] };
        path.extend(points, limit);
        path
    }

    /// Goes on through further points, up to `limit` metres in all.
    pub fn extend(&mut self, points: impl IntoIterator<Item = Point2>, limit: f64) {
        let most = (limit / Self::SPACING) as usize + 1;
        self.points.reserve(most.saturating_sub(self.points.len()).min(USUAL));
        let mut last = self.end();
        let mut carried = 0.0;
        points.into_iter().for_each(|p| {
            let length = last.distance(p);
            let mut s = Self::SPACING - carried;
            while s <= length && self.points.len() < most {
                self.points.push(last.toward(p, s / length));
                s += Self::SPACING;
            }
            carried = length - (s - Self::SPACING);
            last = p;
        });
    }

    /// Metres.
    pub fn length(&self) -> f64 {
        (self.points.len() - 1) as f64 * Self::SPACING
    }

    /// The last point.
    pub fn end(&self) -> Point2 {
        self.points[self.points.len() - 1]
    }

    /// The points.
    pub fn points(&self) -> &[Point2] {
        &self.points
    }

    /// Point after `s` metres; beyond the end straight on.
    pub fn at(&self, s: f64) -> Point2 {
        let last = self.points.len() - 1;
        if last == 0 {
            return self.points[0];
        }
        let scaled = (s / Self::SPACING).max(0.0);
        let k = (scaled as usize).min(last - 1);
        self.points[k].toward(self.points[k + 1], scaled - k as f64)
    }

    /// Index of the point nearest to `p` among `from` and those up to a metre further, nearest first met.
    pub fn advance(&self, from: usize, p: Point2) -> usize {
        let mut best = (self.points[from].distance_squared(p), from);
        let window = (1.0 / Self::SPACING) as usize;
        for k in from + 1..(from + window).min(self.points.len()) {
            let d = self.points[k].distance_squared(p);
            if d < best.0 {
                best = (d, k);
            } else if k > best.1 + 3 {
                break;
            }
        }
        best.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_are_evenly_spaced_around_corners_and_stop_at_the_limit() {
        let corner = [Point2::new(1.05, 0.0), Point2::new(1.05, 2.0)];
        let path = Path::new(Point2::default(), corner, 10.0);
        // 3.05 m of polyline hold 30 whole spacings
        assert_eq!(path.points().len(), 31);
        assert!((path.at(2.05).y - 1.0).abs() < 1e-9);
        assert!((Path::new(Point2::default(), corner, 1.5).length() - 1.5).abs() < 1e-9);
    }

    #[test]
    fn beyond_the_end_the_path_goes_straight_on() {
        let path = Path::new(Point2::default(), [Point2::new(1.0, 0.0)], 10.0);
        assert!((path.at(1.7).x - 1.7).abs() < 1e-9);
        assert_eq!(Path::new(Point2::new(1.0, 2.0), [], 5.0).at(3.0), Point2::new(1.0, 2.0));
    }
}
