//! Planar geometry: points, poses, angles.

use crate::parameters::{Numbers, Range};
use serde::{Deserialize, Serialize};

use crate::numerics::{atan2, sin_cos};

crate::parameters! {
    /// A position in the plane, metres.
    #[derive(Copy, Default)]
    pub struct Point2 {
        /// Metres along the first axis of the frame.
        pub x: f64 [in Range::POSITION],
        /// Metres along the second axis of the frame.
        pub y: f64 [in Range::POSITION],
    }
}

impl Numbers for Point2 {
    fn fault(&self, ranges: &[Range], at: usize) -> Option<(String, f64, Range)> {
        [self.x, self.y].fault(ranges, at)
    }
}

impl Numbers for Pose2 {
    fn fault(&self, ranges: &[Range], at: usize) -> Option<(String, f64, Range)> {
        [self.x, self.y, self.heading].fault(ranges, at)
    }
}

impl Point2 {
    /// The point (x, y), metres.
    pub const fn new(x: f64, y: f64) -> Self {
        Self { x, y }
    }

    /// Euclidean distance, metres.
    pub fn distance(self, other: Self) -> f64 {
        self.distance_squared(other).sqrt()
    }

    /// Squared Euclidean distance, square metres.
    pub fn distance_squared(self, other: Self) -> f64 {
        let dx = other.x - self.x;
        let dy = other.y - self.y;
        dx * dx + dy * dy
    }

    /// The point a share of the straight way to `to`.
    pub fn toward(self, to: Self, share: f64) -> Self {
        Self::new(self.x + share * (to.x - self.x), self.y + share * (to.y - self.y))
    }
}

crate::parameters! {
    /// A position and a heading: the transform from a body frame to its parent frame.
    #[derive(Copy, Default)]
    pub struct Pose2 {
        /// Metres.
        pub x: f64 [in Range::POSITION],
        /// Metres.
        pub y: f64 [in Range::POSITION],
        /// Radians, counter-clockwise from the first axis.
        pub heading: f64 [in Range::HEADING],
    }
}

impl Pose2 {
    /// The pose at (x, y) metres with `heading` radians.
    pub const fn new(x: f64, y: f64, heading: f64) -> Self {
        Self { x, y, heading }
    }

    /// The position alone.
    pub fn position(self) -> Point2 {
        Point2::new(self.x, self.y)
    }

    /// `parent_from_body * body_from_child`: the child seen from the parent.
    pub fn compose(self, child: Self) -> Self {
        let p = self.transform(child.position());
        Self::new(p.x, p.y, wrap_angle(self.heading + child.heading))
    }

    /// A point of the body frame, seen from the parent.
    pub fn transform(self, p: Point2) -> Point2 {
        let (s, c) = sin_cos(self.heading);
        Point2::new(self.x + c * p.x - s * p.y, self.y + s * p.x + c * p.y)
    }

    /// A point of the parent frame, seen from the body.
    pub fn inverse_transform(self, p: Point2) -> Point2 {
        let (s, c) = sin_cos(self.heading);
        let dx = p.x - self.x;
        let dy = p.y - self.y;
        Point2::new(c * dx + s * dy, -s * dx + c * dy)
    }

    /// The pose a share of the way to `to`: in a straight line, turning the shorter way. The heading may leave
    /// (-pi, pi].
    pub fn toward(self, to: Self, share: f64) -> Self {
        let heading = self.heading + share * wrap_angle(to.heading - self.heading);
        let Point2 { x, y } = self.position().toward(to.position(), share);
        Self::new(x, y, heading)
    }

    /// `body_from_other` given both in the same parent frame.
    pub fn relative(self, other: Self) -> Self {
        let p = self.inverse_transform(other.position());
        Self::new(p.x, p.y, wrap_angle(other.heading - self.heading))
    }
}

/// A direction of the plane as a unit vector, for loops in which sines and cosines would take most of the time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Direction {
    /// Cosine of its angle.
    pub cos: f64,
    /// Sine of its angle.
    pub sin: f64,
}

impl Direction {
    /// That of an angle, radians.
    pub fn of(angle: f64) -> Self {
        let (sin, cos) = sin_cos(angle);
        Self { cos, sin }
    }

    /// This one turned further by the angle of another.
    pub fn turned(self, by: Self) -> Self {
        Self { cos: self.cos * by.cos - self.sin * by.sin, sin: self.sin * by.cos + self.cos * by.sin }
    }

    /// Cosine of the angle to another.
    pub fn dot(self, other: Self) -> f64 {
        self.cos * other.cos + self.sin * other.sin
    }

    /// `to` as seen from `from` by what faces this way: how far ahead it lies and how far to the left, metres.
    pub fn ahead_and_left(self, from: Point2, to: Point2) -> (f64, f64) {
        let dx = to.x - from.x;
        let dy = to.y - from.y;
        (self.cos * dx + self.sin * dy, self.cos * dy - self.sin * dx)
    }
}

/// A pose whose direction is known.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Facing {
    /// Where.
    pub pose: Pose2,
    /// That of the pose's heading.
    pub direction: Direction,
}

impl From<Pose2> for Facing {
    fn from(pose: Pose2) -> Self {
        Self { pose, direction: Direction::of(pose.heading) }
    }
}

/// Forward speed and turn rate of a unicycle.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Twist {
    /// Forward speed, m/s.
    pub v: f64,
    /// Turn rate, rad/s, counter-clockwise.
    pub omega: f64,
}

/// The same angle in (-pi, pi].
pub fn wrap_angle(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    // Most angles are at most one turn off, and a remainder takes long.
    let mut a = if angle.abs() < TAU { angle } else { angle % TAU };
    if a > PI {
        a -= TAU;
    } else if a <= -PI {
        a += TAU;
    }
    a
}

/// Direction from `from` to `to`, radians.
pub fn bearing(from: Point2, to: Point2) -> f64 {
    atan2(to.y - from.y, to.x - from.x)
}

/// Least distance between two points that move linearly over the same interval: `from` and `to` are
/// the first point's position relative to the second at its start and end.
pub fn closest_approach(from: Point2, to: Point2) -> f64 {
    let dx = to.x - from.x;
    let dy = to.y - from.y;
    let length_squared = dx * dx + dy * dy;
    let s = if length_squared > 0.0 {
        (-(from.x * dx + from.y * dy) / length_squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    let x = from.x + s * dx;
    let y = from.y + s * dy;
    (x * x + y * y).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    #[test]
    fn wrapping_keeps_the_angle_and_its_range() {
        for k in -20..=20 {
            let a = 0.7 * f64::from(k);
            let w = wrap_angle(a);
            assert!(w > -PI && w <= PI);
            assert!(
                ((a - w) / (2.0 * PI)).fract().abs() < 1e-9
                    || ((a - w) / (2.0 * PI)).fract().abs() > 1.0 - 1e-9
            );
        }
        assert_eq!(wrap_angle(-PI), PI);
    }

    #[test]
    fn relative_undoes_compose() {
        let a = Pose2::new(1.0, -2.0, 0.6);
        let b = Pose2::new(0.3, 0.4, -1.1);
        let back = a.relative(a.compose(b));
        assert!(
            (back.x - b.x).abs() < 1e-12
                && (back.y - b.y).abs() < 1e-12
                && (back.heading - b.heading).abs() < 1e-12
        );
    }

    #[test]
    fn closest_approach_is_inside_the_interval_or_at_an_end() {
        // passes the origin at distance 1 half way
        assert!((closest_approach(Point2::new(-2.0, 1.0), Point2::new(2.0, 1.0)) - 1.0).abs() < 1e-12);
        // moves away: least at the start, 3-4-5
        assert!((closest_approach(Point2::new(3.0, 4.0), Point2::new(6.0, 8.0)) - 5.0).abs() < 1e-12);
        assert_eq!(closest_approach(Point2::new(3.0, 4.0), Point2::new(3.0, 4.0)), 5.0);
    }
}
