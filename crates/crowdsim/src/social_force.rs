//! The law of people who walk as if forces acted on them.
//!
//! The idea and the drive towards the goal: Helbing and Molnar, "Social force model for pedestrian dynamics", Physical
//! Review E 51, 1995. The force between two people, that of walls, and all numbers: Moussaid, Helbing, Garnier,
//! Johansson, Combe and Theraulaz, "Experimental study of the behavioural mechanisms underlying self-organization in
//! human crowds", Proceedings of the Royal Society B 276, 2009, who fitted them to people in a corridor. Forces are per
//! unit of mass, so they are accelerations.

use curionav_planning::geometry::wrap_angle;
use curionav_planning::hrvo::{Body, Velocity};
use curionav_planning::numerics::{atan2, exp};
use curionav_planning::parameters::Range;

use crate::avoiding::wall_rim::NearWall;

curionav_planning::parameters! {
    /// Parameters of people who walk by social forces. Defaults are those of Moussaid et al. (2009).
    #[derive(Copy)]
    pub struct SocialForceParams {
        /// Time in which a person takes up the velocity it wants, seconds.
        pub relaxation_s: f64 [0.05, 10.0, "s", "no body answers sooner, and later none steers"] = 0.54,
        /// Strength of the force between two people, m/s2.
        pub strength: f64 [0.0, 100.0, "m/s2", "no person stands ten times its weight"] = 4.5,
        /// Reach of that force per length of the interaction vector, metres.
        pub reach: f64 [0.01, 10.0, "m", "shorter is contact, longer is out of sight"] = 0.35,
        /// How sharply the force that turns falls with the angle, per metre.
        pub turn_sharpness: f64 [0.0, 100.0, "1/m", "sharper than that it acts straight ahead alone"] = 2.0,
        /// How sharply the force that slows falls with the angle, per metre.
        pub slow_sharpness: f64 [0.0, 100.0, "1/m", "sharper than that it acts straight ahead alone"] = 3.0,
        /// How much the other's relative velocity counts beside the direction to it, s/m.
        pub foresight: f64 [0.0, 100.0, "s/m", "more is relative velocity alone"] = 2.0,
        /// Preference for one side when the other is straight ahead, per metre of the force's reach, radians.
        pub side: f64 [-1.0, 1.0, "rad/m", "more is walking in circles"] = 0.005,
        /// Force of a wall at its surface, m/s2.
        pub wall_strength: f64 [0.0, 100.0, "m/s2", "no person stands ten times its weight"] = 3.0,
        /// Distance in which the force of a wall falls to a third, metres.
        pub wall_reach: f64 [0.01, 10.0, "m", "shorter is contact, longer is the next wall"] = 0.1,
        /// Others farther away than this, centre to centre, are not minded, metres. Not of the article: at 8 m the
        /// force is below a hundredth of its strength.
        pub neighbor_distance: f64
            [0.1, 100.0, "m", "people nearer than that touch, and people farther away do not matter"] = 8.0,
        /// A route's corner is reached this near to it, metres. Not of the article.
        pub goal_radius: f64 [in Range::GOAL_TOLERANCE] = 0.3,
        /// Fastest a person walks, as a factor of the preferred speed: Helbing and Molnar's 1.3.
        pub max_speed_factor: f64 [1.0, 10.0, "", "a person can at least walk as fast as preferred"] = 1.3,
    }
}

/// Acceleration of the i-th body towards the velocity that it prefers and away from others and walls, m/s2.
pub(crate) fn acceleration(
    i: usize,
    bodies: &[Body],
    walls: &[NearWall],
    params: &SocialForceParams,
) -> Velocity {
    let me = &bodies[i];
    let mut sum = (me.preferred - me.velocity) / params.relaxation_s;
    for (j, other) in bodies.iter().enumerate() {
        if j != i && me.position.distance(other.position) <= params.neighbor_distance {
            sum += interaction(me, other, params);
        }
    }
    for wall in walls {
        sum -= wall.towards * (params.wall_strength * exp(-wall.distance / params.wall_reach));
    }
    sum
}

/// What `other` does to `me`: it slows along the interaction vector `D = foresight (v_me - v_other) + e` and turns
/// across it, `e` being the direction to the other.
fn interaction(me: &Body, other: &Body, params: &SocialForceParams) -> Velocity {
    let apart = Velocity::new(other.position.x - me.position.x, other.position.y - me.position.y);
    let distance = apart.norm();
    // Two in the same place part along the first axis.
    let towards = if distance > 0.0 { apart / distance } else { Velocity::x() };
    let vector = (me.velocity - other.velocity) * params.foresight + towards;
    let length = vector.norm();
    if length == 0.0 {
        return Velocity::zeros();
    }
    let along = vector / length;
    let left = Velocity::new(-along.y, along.x);
    let reach = params.reach * length;
    // From the interaction vector to the other, counter-clockwise; one straight ahead counts as one a little to the
    // left.
    let angle = wrap_angle(atan2(towards.y, towards.x) - atan2(along.y, along.x)) + params.side * reach;
    let [slow, turn] = [params.slow_sharpness, params.turn_sharpness].map(|sharpness| {
        let spread = sharpness * reach * angle;
        params.strength * exp(-distance / reach - spread * spread)
    });
    -along * slow - left * (angle.signum() * turn)
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Point2;

    use super::*;

    fn body(x: f64, y: f64, vx: f64, vy: f64) -> Body {
        let velocity = Velocity::new(vx, vy);
        let position = Point2::new(x, y);
        Body { position, velocity, preferred: velocity, radius: 0.25, yields: true }
    }

    fn force(me: Body, other: Body) -> Velocity {
        interaction(&me, &other, &SocialForceParams::default())
    }

    #[test]
    fn the_force_is_that_of_the_article() {
        // Head-on at 3 m with 1 m/s each: D = 2 * 2 + 1 = 5, B = 0.35 * 5 = 1.75, theta = 0.005 * 1.75.
        let found = force(body(0.0, 0.0, 1.0, 0.0), body(3.0, 0.0, -1.0, 0.0));
        let (b, theta) = (1.75_f64, 0.005 * 1.75);
        let expected = |n: f64| -4.5 * (-3.0 / b - (n * b * theta).powi(2)).exp();
        assert!(
            (found.x - expected(3.0)).abs() < 1e-12 && (found.y - expected(2.0)).abs() < 1e-12,
            "{found}"
        );
    }

    #[test]
    fn the_force_is_that_of_another_implementation() {
        // Computed with PySocialForce 1.1.2 (MIT, PyPI), which has no preference for a side.
        let params = SocialForceParams { strength: 1.0, side: 0.0, ..SocialForceParams::default() };
        let rows = include_str!("social_force/reference.txt").lines().filter(|line| !line.starts_with('#'));
        for row in rows.clone() {
            let n: Vec<f64> = row.split(' ').map(|word| word.parse().unwrap()).collect();
            let found = interaction(&body(n[0], n[1], n[2], n[3]), &body(n[4], n[5], n[6], n[7]), &params);
            assert!((found - Velocity::new(n[8], n[9])).norm() < 1e-9, "{row}: {found}");
        }
        assert_eq!(rows.count(), 24);
    }

    #[test]
    fn one_who_comes_matters_more_than_one_who_stands_and_one_who_goes_least() {
        let towards = |vx: f64| force(body(0.0, 0.0, 1.0, 0.0), body(2.0, 0.2, vx, 0.0)).norm();
        assert!(towards(-1.0) > towards(0.0) && towards(0.0) > towards(1.0));
    }

    #[test]
    fn others_are_passed_on_the_side_where_they_are_not() {
        let side = |y: f64| force(body(0.0, 0.0, 1.0, 0.0), body(2.0, y, -1.0, 0.0)).y;
        assert!(side(0.3) < 0.0 && side(-0.3) > 0.0);
        // Mirror images, but for the preference for one side.
        let even = SocialForceParams { side: 0.0, ..SocialForceParams::default() };
        let mirrored = |y: f64| interaction(&body(0.0, 0.0, 1.0, 0.0), &body(2.0, y, -1.0, 0.0), &even);
        assert!((mirrored(0.3).y + mirrored(-0.3).y).abs() < 1e-12);
        assert!((mirrored(0.3).x - mirrored(-0.3).x).abs() < 1e-12);
    }

    #[test]
    fn alone_it_takes_up_the_velocity_it_wants_in_the_relaxation_time() {
        let mut me = Body { preferred: Velocity::new(1.2, 0.0), ..body(0.0, 0.0, 0.0, 0.0) };
        let params = SocialForceParams::default();
        let dt = 0.001;
        for _ in 0..540 {
            me.velocity += acceleration(0, &[me], &[], &params) * dt;
        }
        let expected = 1.2 * (1.0 - (-1.0_f64).exp());
        assert!((me.velocity.x - expected).abs() < 2e-3, "{}", me.velocity);
    }

    #[test]
    fn a_wall_pushes_away_with_three_tenths_of_the_weight_at_its_surface() {
        let me = body(0.0, 0.0, 0.0, 0.0);
        let wall = |distance| NearWall { towards: Velocity::y(), distance };
        let pushed = |distance| acceleration(0, &[me], &[wall(distance)], &SocialForceParams::default()).y;
        assert!((pushed(0.0) + 3.0).abs() < 1e-12);
        assert!((pushed(0.1) / pushed(0.0) - (-1.0_f64).exp()).abs() < 1e-12);
    }
}
