//! The legs of people who walk, as a laser near the floor sees them.

use curionav_planning::geometry::Point2;
use curionav_planning::numerics::{hypot, sin_cos};
use curionav_planning::scene::People;

use crate::lidar::Bodies;

/// Radius of a leg, metres: 0.12 m across.
const LEG_RADIUS: f64 = 0.06;
/// Distance of a leg's centre from the line that the person walks along, metres.
const ASIDE: f64 = 0.1;
/// How far a leg swings before and behind the person at 1 m/s and above, metres. It grows with the speed.
const SWING: f64 = 0.2;
/// Metres that a person walks while each leg swings forth and back once: at rest, and per m/s more.
const STRIDE: [f64; 2] = [0.7, 0.6];
/// Slower people stand, m/s.
const STANDING: f64 = 0.05;

/// Both legs of all people. The swing follows from where a person is and how it moves, so the same world always looks
/// the same: the phase grows with the metres walked in the present direction, and two people who walk side by side are
/// not in step.
pub(crate) fn legs(people: &People) -> Bodies {
    let centres = (0..people.len()).flat_map(|i| of_person(people, i)).collect();
    Bodies { centres, radius: LEG_RADIUS }
}

fn of_person(people: &People, i: usize) -> [Point2; 2] {
    let p = people.position(i);
    let v = Point2::new(people.vx[i], people.vy[i]);
    let speed = hypot(v.x, v.y);
    // Angles that differ from person to person.
    let own = f64::from(people.id[i] % 1009) * 2.4;
    let (ahead, swing) = if speed < STANDING {
        let (sin, cos) = sin_cos(own);
        (Point2::new(cos, sin), 0.0)
    } else {
        let ahead = Point2::new(v.x / speed, v.y / speed);
        let pace = speed.min(1.0);
        let walked = ahead.x * p.x + ahead.y * p.y;
        let phase = std::f64::consts::TAU * walked / (STRIDE[0] + STRIDE[1] * pace);
        (ahead, SWING * pace * sin_cos(phase + own).0)
    };
    [1.0, -1.0].map(|side| {
        let along = side * swing;
        let across = side * ASIDE;
        Point2::new(p.x + along * ahead.x - across * ahead.y, p.y + along * ahead.y + across * ahead.x)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    /// One person at `x` who walks along x with `speed`.
    fn one(x: f64, speed: f64) -> [Point2; 2] {
        let (id, x, y) = (vec![3], vec![x], vec![2.0]);
        let people = People { id, x, y, vx: vec![speed], vy: vec![0.0], ..People::default() };
        of_person(&people, 0)
    }

    #[test]
    fn legs_swing_against_each_other_around_the_person_and_stay_within_reach_of_each_other() {
        let mut widest = 0.0_f64;
        for step in 0..200 {
            let x = 0.013 * f64::from(step);
            let [left, right] = one(x, 1.0);
            let middle = left.toward(right, 0.5);
            assert!(middle.distance(Point2::new(x, 2.0)) < 1e-12);
            widest = widest.max(left.distance(right));
        }
        // Twice the hypotenuse of 0.2 m and 0.1 m.
        assert!((widest - 0.4472).abs() < 1e-3, "{widest}");
    }

    #[test]
    fn a_stride_at_one_metre_per_second_is_1_3_m_long() {
        let (now, later) = (one(0.4, 1.0), one(1.7, 1.0));
        for (a, b) in now.iter().zip(later) {
            assert!((b.x - a.x - 1.3).abs() < 1e-9 && (b.y - a.y).abs() < 1e-9);
        }
    }

    #[test]
    fn a_person_who_stands_has_both_legs_under_the_trunk() {
        let [left, right] = one(1.0, 0.0);
        assert!((left.distance(right) - 2.0 * ASIDE).abs() < 1e-12);
    }
}
