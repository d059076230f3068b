//! When the robot and a person would touch.

use crate::geometry::{Pose2, Twist};
use crate::numerics::sin_cos;
use crate::scene::People;

/// Seconds until the robot, a disc of `radius` metres, and one of `people` touch if all go on at constant velocity:
/// when
/// |p + v t| = R for the first time. 0 if they touch already, infinite if they never will.
pub fn time_to_collision(pose: Pose2, twist: Twist, radius: f64, people: &People) -> f64 {
    let (sine, cosine) = sin_cos(pose.heading);
    let of_person = |i: usize| {
        let px = people.x[i] - pose.x;
        let py = people.y[i] - pose.y;
        let vx = people.vx[i] - twist.v * cosine;
        let vy = people.vy[i] - twist.v * sine;
        let reach = radius + people.radius;
        let beyond = px * px + py * py - reach * reach;
        if beyond <= 0.0 {
            return 0.0;
        }
        let closing = -(px * vx + py * vy);
        let speed_squared = vx * vx + vy * vy;
        let discriminant = closing * closing - speed_squared * beyond;
        if closing <= 0.0 || discriminant < 0.0 {
            return f64::INFINITY;
        }
        // the smaller root, in the form that loses no digits
        beyond / (closing + discriminant.sqrt())
    };
    (0..people.len()).map(of_person).fold(f64::INFINITY, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn seconds(x: f64, y: f64, vx: f64, vy: f64) -> f64 {
        let people = People::walking(0.2, &[[x, y, vx, vy]]);
        time_to_collision(Pose2::default(), Twist { v: 1.0, omega: 0.0 }, 0.3, &people)
    }

    #[test]
    fn time_to_collision_is_that_of_two_discs() {
        // 4.5 m ahead, towards each other at 1 + 1 m/s, radii 0.3 + 0.2: (4.5 - 0.5) / 2 = 2 s
        assert!((seconds(4.5, 0.0, -1.0, 0.0) - 2.0).abs() < 1e-12);
        // standing 0.3 m aside: touched where 0.5^2 = 0.3^2 + 0.4^2, 2.4 - 0.4 = 2 m ahead
        assert!((seconds(2.4, 0.3, 0.0, 0.0) - 2.0).abs() < 1e-12);
        // 0.6 m aside, as fast as the robot, going away, behind: never
        for never in [(2.0, 0.6, 0.0, 0.0), (2.0, 0.0, 1.0, 0.0), (2.0, 0.0, 1.5, 0.0), (-2.0, 0.0, 0.0, 0.0)]
        {
            assert_eq!(seconds(never.0, never.1, never.2, never.3), f64::INFINITY);
        }
        assert_eq!(seconds(0.3, 0.3, 5.0, 0.0), 0.0); // overlap
    }
}
