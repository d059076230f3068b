//! Velocities that lead into another body or a wall.

use crate::geometry::Point2;

use super::Velocity;

/// A disc that moves and is seen by others.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// Map frame, metres.
    pub position: Point2,
    /// m/s.
    pub velocity: Velocity,
    /// The velocity it would have with no others around, m/s: it decides on which side others pass.
    pub preferred: Velocity,
    /// Metres.
    pub radius: f64,
    /// Whether it takes its half of the avoiding. A recorded or standing person does not; the robot is
    /// taken for one that does.
    pub yields: bool,
}

/// A cone of forbidden velocities: those strictly between the rays from `apex` along its two sides.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct VelocityObstacle {
    /// m/s.
    pub apex: Velocity,
    /// Direction of the right-hand side, seen from the apex; unit length.
    pub right: Velocity,
    /// Direction of the left-hand side; unit length. Opposite to the right one for a half-plane.
    pub left: Velocity,
}

impl VelocityObstacle {
    /// What `other` forbids `me`, with steps of `dt` seconds.
    ///
    /// The velocity obstacle proper has its apex at the other's velocity, the reciprocal one (each takes
    /// half of the avoiding) half way to ours. The hybrid of both lets the side on which `me` would pass
    /// anyway stay that of the reciprocal obstacle and moves the other side out to that of the proper one,
    /// so that the two never dance. Who passes on the right is given a wider berth, as by the library of
    /// the method's authors, whose trajectories this reproduces: there the apex lies as far behind the
    /// other's velocity, along the left side, as the geometry puts it before. `offset`: see
    /// [`super::HrvoParams::uncertainty_offset`].
    pub fn of_body(me: &Body, other: &Body, dt: f64, offset: f64) -> Self {
        let apart = Velocity::new(other.position.x - me.position.x, other.position.y - me.position.y);
        let distance = apart.norm();
        let reach = me.radius + other.radius;
        // Two in the same place part along the first axis, the choice of sides does the rest.
        let towards = if distance > 0.0 { apart / distance } else { Velocity::x() };
        let sine = reach / distance.max(f64::MIN_POSITIVE);
        let cosine = (1.0 - sine * sine).max(0.0).sqrt();
        if cosine == 0.0 {
            let apex = 0.5 * (me.velocity + other.velocity)
                - towards * (offset + 0.5 * (reach - distance).max(0.0) / dt);
            return Self::half_plane(apex, towards);
        }
        let right = turned(towards, cosine, -sine);
        let left = turned(towards, cosine, sine);
        let apex = if other.yields {
            // Where the reciprocal cone's one side meets the proper cone's other side.
            let double_sine = 2.0 * sine * cosine;
            let relative = me.velocity - other.velocity;
            if apart.perp(&(me.preferred - other.preferred)) > 0.0 {
                other.velocity + right * (0.5 * relative.perp(&left) / double_sine)
            } else {
                other.velocity + left * (0.5 * relative.perp(&right) / double_sine)
            }
        } else {
            other.velocity
        };
        Self { apex: apex - towards * (offset * distance / reach), right, left }
    }

    /// What a wall forbids whose nearest point is in direction `towards` (unit length): a speed towards it
    /// that closes the gap, metres, within `horizon` seconds. All of the avoiding is ours.
    pub fn of_wall(towards: Velocity, gap: f64, horizon: f64) -> Self {
        Self::half_plane(towards * (gap / horizon), towards)
    }

    fn half_plane(apex: Velocity, towards: Velocity) -> Self {
        let right = turned(towards, 0.0, -1.0);
        Self { apex, right, left: -right }
    }

    /// Whether the velocity is forbidden.
    pub fn holds(&self, velocity: Velocity) -> bool {
        let from_apex = velocity - self.apex;
        self.right.perp(&from_apex) > 0.0 && self.left.perp(&from_apex) < 0.0
    }
}

fn turned(v: Velocity, cosine: f64, sine: f64) -> Velocity {
    Velocity::new(cosine * v.x - sine * v.y, sine * v.x + cosine * v.y)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn body(x: f64, vx: f64) -> Body {
        let velocity = Velocity::new(vx, 0.0);
        let position = Point2::new(x, 0.0);
        Body { position, velocity, preferred: velocity, radius: 0.5, yields: true }
    }

    #[test]
    fn the_cone_touches_the_disc_of_both_radii() {
        // 2 m apart, radii 0.5 + 0.5: half angle 30 degrees
        let cone =
            VelocityObstacle::of_body(&body(0.0, 0.0), &Body { yields: false, ..body(2.0, 0.3) }, 0.1, 0.0);
        assert_eq!(cone.apex, Velocity::new(0.3, 0.0));
        assert!((cone.left - Velocity::new(0.75_f64.sqrt(), 0.5)).norm() < 1e-12);
        assert!((cone.right - Velocity::new(0.75_f64.sqrt(), -0.5)).norm() < 1e-12);
        assert!(cone.holds(Velocity::new(1.0, 0.0)) && !cone.holds(Velocity::new(0.2, 0.0)));
        assert!(!cone.holds(Velocity::new(0.4, 0.1)));
    }

    #[test]
    fn half_of_the_avoiding_is_the_others_on_the_side_of_passing() {
        // Half angle 30 degrees, relative velocity (2, 0). Passing on the left: the left side of the
        // reciprocal cone, through (0, 0), meets the right one of the proper cone, through (-1, 0), at
        // x = -1/2, y = -tan(30) / 2.
        let me = Body { preferred: Velocity::new(1.0, 0.1), ..body(0.0, 1.0) };
        let tan_30 = (1.0 / 3.0_f64).sqrt();
        let cone = VelocityObstacle::of_body(&me, &body(2.0, -1.0), 0.1, 0.0);
        assert!((cone.apex - Velocity::new(-0.5, -0.5 * tan_30)).norm() < 1e-12, "{:?}", cone.apex);
        // Passing on the right: by the same (1/2, tan(30) / 2) behind (-1, 0)
        let me = Body { preferred: Velocity::new(1.0, -0.1), ..body(0.0, 1.0) };
        let cone = VelocityObstacle::of_body(&me, &body(2.0, -1.0), 0.1, 0.0);
        assert!((cone.apex - Velocity::new(-1.5, -0.5 * tan_30)).norm() < 1e-12, "{:?}", cone.apex);
    }

    #[test]
    fn who_overlaps_must_part() {
        // 0.4 m too near: half of it within 0.1 s is 2 m/s away from the other
        let cone = VelocityObstacle::of_body(&body(0.0, 0.0), &body(0.6, 0.0), 0.1, 0.0);
        assert!(cone.holds(Velocity::new(-1.9, 5.0)) && !cone.holds(Velocity::new(-2.1, 5.0)));
        // two in one place still part
        let cone = VelocityObstacle::of_body(&body(0.0, 0.0), &body(0.0, 0.0), 0.1, 0.0);
        assert!(cone.holds(Velocity::zeros()));
    }

    #[test]
    fn a_wall_forbids_only_speed_towards_it() {
        let wall = VelocityObstacle::of_wall(Velocity::new(0.0, 1.0), 0.2, 0.5);
        assert!(wall.holds(Velocity::new(3.0, 0.41)) && !wall.holds(Velocity::new(3.0, 0.39)));
    }

    #[test]
    fn distrust_moves_the_apex_nearer() {
        // offset 0.1 m/s at twice the combined radius: 0.2 m/s
        let standing = Body { yields: false, ..body(2.0, 0.0) };
        let cone = VelocityObstacle::of_body(&body(0.0, 0.0), &standing, 0.1, 0.1);
        assert!((cone.apex - Velocity::new(-0.2, 0.0)).norm() < 1e-12);
    }
}
