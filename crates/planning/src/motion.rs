//! The unicycle: state, limits, exact motion over a step, and odometry noise (eqs. 1 and 7).

use crate::parameters::{Field, FieldError, Kind, Range, Ranged, check_numbers, check_table};
use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::geometry::{Direction, Facing, Point2, Pose2, Twist, wrap_angle};
use crate::numerics::{SMALL_ANGLE, sin_cos, sinc_cos};
use crate::sensor::LaserModel;

/// The robot's outline in its own frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "shape", deny_unknown_fields)]
#[expect(missing_docs, reason = "the text of each outline says what its fields are")]
pub enum Footprint {
    /// A disc of this radius around the robot's centre, metres.
    Disc { radius: f64 },
    /// A convex polygon: at least three counter-clockwise vertices in the robot frame, metres.
    Polygon { vertices: Vec<Point2> },
}

impl Ranged for Footprint {
    const FIELDS: &'static [Field] = &[
        Field {
            name: "shape",
            ty: "String",
            meaning: &["`\"disc\"`, with `radius`, or `\"polygon\"`, with `vertices`."],
            kind: Kind::Plain,
        },
        Field {
            name: "radius",
            ty: "f64",
            meaning: &["Of a disc, metres. A polygon's vertices lie within the same distances."],
            kind: Kind::Numbers(
                &[Range {
                    least: 0.05,
                    most: 5.0,
                    unit: "m",
                    why: "a service robot is no smaller and no larger",
                }],
                None,
            ),
        },
        Field {
            name: "vertices",
            ty: "Vec<Point2>",
            meaning: &[
                "Of a convex polygon, counter-clockwise, each with `x` and `y` in the robot's frame, metres.",
            ],
            kind: Kind::Table(
                Point2::FIELDS,
                Some(Range { least: 3.0, most: 64.0, unit: "entries", why: "fewer have no area" }),
            ),
        },
    ];

    fn check(&self) -> Result<(), FieldError> {
        let [_, radius, vertices] = Self::FIELDS else { return Ok(()) };
        match self {
            Self::Disc { radius: r } => check_numbers(r, radius),
            Self::Polygon { vertices: v } => {
                check_table(v, vertices)?;
                self.is_convex()?;
                check_numbers(&self.circumscribed_radius(), &Field { name: vertices.name, ..*radius })
            }
        }
    }
}

impl Footprint {
    fn is_convex(&self) -> Result<(), FieldError> {
        let Self::Polygon { vertices } = self else { return Ok(()) };
        let left_turn = |i: usize| {
            let at = |k: usize| vertices[(i + k) % vertices.len()];
            let a = at(0);
            let b = at(1);
            let c = at(2);
            (b.x - a.x) * (c.y - b.y) - (b.y - a.y) * (c.x - b.x) > 0.0
        };
        if (0..vertices.len()).all(left_turn) {
            return Ok(());
        }
        let mend = "list the vertices of a convex polygon counter-clockwise";
        Err(FieldError::new("vertices", "is not a convex polygon", mend))
    }

    /// Radius of the smallest robot-centred disc that holds the footprint, metres.
    pub fn circumscribed_radius(&self) -> f64 {
        match self {
            Self::Disc { radius } => *radius,
            Self::Polygon { vertices } => {
                vertices.iter().map(|v| v.distance(Point2::default())).fold(0.0, f64::max)
            }
        }
    }
}

crate::parameters! {
    /// What the base can do (A27): a disc of 0.3 m, 0..1 m/s, 0.5 m/s2.
    pub struct RobotModel {
        /// Outline used for collision checks.
        pub footprint: Footprint [table] = Footprint::Disc { radius: 0.3 },
        /// Greatest forward speed, m/s.
        pub v_max: f64 [0.01, 10.0, "m/s", "slower ones never arrive, faster ones do not belong among people"] = 1.0,
        /// Greatest acceleration and braking, m/s2.
        pub a_max: f64 [0.01, 20.0, "m/s2", "weaker brakes need a hall to stop in, stronger ones no tyre has"] = 0.5,
        /// Greatest turn rate, rad/s.
        pub omega_max: f64 [0.01, 20.0, "rad/s", "slower ones never turn; three turns a second are plenty"] = 1.0,
        /// Greatest change of turn rate, rad/s2.
        pub alpha_max: f64 [0.01, 100.0, "rad/s2", "slower ones never turn; stronger motors no base has"] = 1.0,
        /// Greatest speed backwards, m/s, no more than `v_max`. At 0 the robot never drives backwards. Otherwise it
        /// backs by up to 0.3 m where a recovery finds no other way out and the laser sees what is behind.
        #[serde(skip_serializing_if = "is_zero")]
        pub v_reverse: f64 [0.0, 1.0, "m/s", "backwards is for the last resort, and no robot hurries there"] = 0.0,
    } check Self::is_slower_backwards
}

fn is_zero(speed: &f64) -> bool {
    *speed == 0.0
}

impl RobotModel {
    fn is_slower_backwards(&self) -> Result<(), FieldError> {
        if self.v_reverse <= self.v_max {
            return Ok(());
        }
        let problem = format!("is {}, and v_max {}", self.v_reverse, self.v_max);
        Err(FieldError::new("v_reverse", problem, "give no more than v_max"))
    }

    /// Circumscribed radius of the footprint, metres.
    pub fn radius(&self) -> f64 {
        self.footprint.circumscribed_radius()
    }

    /// The twist reached after `dt` seconds when `wanted` is asked for: clipped to the speed limits and
    /// to what acceleration allows from `current`. Never backwards faster than `v_reverse`.
    pub fn limit(&self, current: Twist, wanted: Twist, dt: f64) -> Twist {
        let omega =
            wanted.omega.clamp(current.omega - self.alpha_max * dt, current.omega + self.alpha_max * dt);
        let omega = omega.clamp(-self.omega_max, self.omega_max);
        Twist { v: self.limit_speed(current.v, wanted.v, dt), omega }
    }

    /// The speed of [`Self::limit`], m/s. A robot that is faster than the limits brakes as hard as it can.
    pub fn limit_speed(&self, current: f64, wanted: f64, dt: f64) -> f64 {
        let least = current - self.a_max * dt;
        let most = current + self.a_max * dt;
        // Not the negative of 0, which is another number.
        let backwards = (0.0 - self.v_reverse).min(most);
        wanted.clamp(least, most).clamp(backwards, self.v_max.max(least))
    }

    /// The robot with this share of its greatest speeds.
    #[must_use]
    pub fn slowed(&self, share: f64) -> Self {
        Self { v_max: share * self.v_max, v_reverse: share * self.v_reverse, ..self.clone() }
    }

    /// The robot that never drives backwards.
    #[must_use]
    pub fn forwards(&self) -> Self {
        Self { v_reverse: 0.0, ..self.clone() }
    }

    /// The robot as it may be planned for with this laser: backwards only if that is where the laser looks.
    #[must_use]
    pub fn seeing_with(&self, laser: &LaserModel) -> Self {
        if laser.sees_behind() { self.clone() } else { self.forwards() }
    }

    /// Distance needed to stop from `v` m/s at full braking, metres.
    pub fn stopping_distance(&self, v: f64) -> f64 {
        v * v / (2.0 * self.a_max)
    }

    /// Mean speed below which a candidate counts as slow (D4), m/s: the share `min_speed / v_max` of the mean of the
    /// fastest one, which goes straight on from `v` m/s and stands after `steps` states `dt` seconds apart. From rest,
    /// and with a stop at the end as every candidate has, none is as fast as a robot that cruises.
    pub fn slow_below(&self, min_speed: f64, v: f64, steps: usize, dt: f64) -> f64 {
        let after = |k: usize| self.v_max.min(v + self.a_max * dt * k as f64);
        let before_stop = |k: usize| self.a_max * dt * (steps - k) as f64;
        let fastest = (1..=steps).map(|k| after(k).min(before_stop(k))).sum::<f64>() / steps.max(1) as f64;
        min_speed * fastest / self.v_max
    }
}

/// Pose after `dt` seconds at a constant twist: the exact arc.
pub fn step(pose: Pose2, twist: Twist, dt: f64) -> Pose2 {
    step_facing(pose.into(), twist, dt).pose
}

/// The same for a pose whose direction is known.
#[inline]
pub fn step_facing(from: Facing, twist: Twist, dt: f64) -> Facing {
    Bend::new(twist.omega * dt).end(from, twist.v * dt)
}

/// An arc that turns by some angle, however long it is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Bend {
    /// How far it turns, radians.
    turn: f64,
    /// The length of its chord, as a share of its own.
    chord: f64,
    /// Half of the turn.
    half: Direction,
}

impl Bend {
    #[inline]
    pub(crate) fn new(turn: f64) -> Self {
        let half = 0.5 * turn;
        let (sinc, cos) = if half.abs() <= SMALL_ANGLE {
            sinc_cos(half)
        } else {
            let (sin, cos) = sin_cos(half);
            (sin / half, cos)
        };
        Self { turn, chord: sinc, half: Direction { cos, sin: half * sinc } }
    }

    /// Where it ends when it is `length` metres long.
    #[inline]
    pub(crate) fn end(&self, from: Facing, length: f64) -> Facing {
        // The chord's direction is the mean heading.
        let chord = length * self.chord;
        let middle = from.direction.turned(self.half);
        let Pose2 { x, y, heading } = from.pose;
        let pose =
            Pose2::new(x + chord * middle.cos, y + chord * middle.sin, wrap_angle(heading + self.turn));
        Facing { pose, direction: middle.turned(self.half) }
    }
}

crate::parameters! {
    /// Odometry noise as variances per metre and per radian travelled, so that it does not depend on the
    /// step length (D6). The plant, the localiser and CPC's `M'` (eq. 7) share these four numbers.
    ///
    /// The defaults are what `curionav localize --fit` finds on recorded drives of three bases, on average: Intel
    /// Research Lab, MIT CSAIL and FHW. A metre spreads the heading by 3.6 degrees and the position by 6 cm, a radian
    /// of turning the heading by 4.4 degrees (standard deviations). The fit's position per radian is mostly the
    /// localiser's own error; a quarter of it is taken.
    #[derive(Copy)]
    pub struct OdometryNoise {
        /// Variance of position per metre travelled, on each robot axis, m2/m.
        pub position_per_metre: f64 [0.0, 1.0, "m2/m", "a metre of error per metre driven is no odometry"] = 0.004,
        /// Variance of position per radian turned, on each robot axis, m2/rad.
        pub position_per_radian: f64
            [0.0, 1.0, "m2/rad", "a metre of error per metre driven is no odometry"] = 0.001,
        /// Variance of heading per metre travelled, rad2/m.
        pub heading_per_metre: f64 [0.0, 1.0, "rad2/m", "a metre of error per metre driven is no odometry"] = 0.004,
        /// Variance of heading per radian turned, rad2/rad.
        pub heading_per_radian: f64
            [0.0, 1.0, "rad2/rad", "a metre of error per metre driven is no odometry"] = 0.006,
    }
}

impl OdometryNoise {
    /// Variances (along, across, heading) in the robot frame of one motion increment of `travel`
    /// metres and `turn` radians (either sign).
    pub fn variances(&self, travel: f64, turn: f64) -> Vector3<f64> {
        let d = travel.abs();
        let a = turn.abs();
        let position = self.position_per_metre * d + self.position_per_radian * a;
        Vector3::new(position, position, self.heading_per_metre * d + self.heading_per_radian * a)
    }

    /// The process noise `M'` of eq. 7 in the map frame. The position part is isotropic, so it does
    /// not depend on the heading.
    pub fn process_covariance(&self, travel: f64, turn: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.variances(travel, turn))
    }

    /// `A Sigma A' + M'`: the covariance of a pose after an increment of `travel` metres and `turn` radians that moved
    /// it by `displacement` in the map frame (eq. 7). A heading error swings the displacement around.
    pub fn propagate(
        &self,
        covariance: &Matrix3<f64>,
        displacement: Point2,
        travel: f64,
        turn: f64,
    ) -> Matrix3<f64> {
        let a = Matrix3::new(1.0, 0.0, -displacement.y, 0.0, 1.0, displacement.x, 0.0, 0.0, 1.0);
        a * covariance * a.transpose() + self.process_covariance(travel, turn)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_full_turn_ends_where_it_began() {
        let mut p = Pose2::new(1.0, 2.0, 0.3);
        for _ in 0..100 {
            p = step(p, Twist { v: 0.5, omega: 0.2 * std::f64::consts::PI }, 0.1);
        }
        assert!((p.x - 1.0).abs() < 1e-9 && (p.y - 2.0).abs() < 1e-9 && (p.heading - 0.3).abs() < 1e-9);
    }

    #[test]
    fn noise_does_not_depend_on_the_step_length() {
        let n = OdometryNoise::default();
        let once = n.process_covariance(1.0, 0.5);
        let tenth = n.process_covariance(0.1, 0.05) * 10.0;
        assert!((once - tenth).norm() < 1e-12);
    }

    #[test]
    fn limits_hold_whatever_is_asked() {
        let m = RobotModel::default();
        let t = m.limit(Twist { v: 0.9, omega: 0.0 }, Twist { v: 9.0, omega: -9.0 }, 0.1);
        assert!((t.v - 0.95).abs() < 1e-12 && (t.omega + 0.1).abs() < 1e-12);
        assert_eq!(m.limit(Twist { v: 0.0, omega: 0.0 }, Twist { v: -1.0, omega: 0.0 }, 0.1).v, 0.0);
    }

    #[test]
    fn backwards_it_is_no_faster_than_its_model_says() {
        let forwards = RobotModel::default();
        let backs = RobotModel { v_reverse: 0.2, ..RobotModel::default() };
        for current in [0.0, 0.03, 0.5, 1.2] {
            for wanted in [-1.0, -0.0, 0.0, 0.7] {
                let speed = forwards.limit_speed(current, wanted, 0.1);
                let before =
                    wanted.clamp(current - 0.05, current + 0.05).clamp(0.0, 1.0_f64.max(current - 0.05));
                assert_eq!(speed.to_bits(), before.to_bits(), "{current} {wanted}");
            }
        }
        assert_eq!(backs.limit_speed(0.0, -1.0, 0.1), -0.05);
        assert_eq!(backs.limit_speed(-0.18, -1.0, 0.1), -0.2);
        // What rolls back faster than it may brakes as hard as it can.
        assert!((forwards.limit_speed(-0.2, 0.5, 0.1) + 0.15).abs() < 1e-12);
        assert!((backs.limit_speed(-0.5, -1.0, 0.1) + 0.45).abs() < 1e-12);
    }

    #[test]
    fn no_model_is_faster_backwards_than_forwards() {
        let refused = RobotModel { v_max: 0.3, v_reverse: 0.4, ..RobotModel::default() }.check().unwrap_err();
        assert_eq!(refused.to_string(), "v_reverse: is 0.4, and v_max 0.3; give no more than v_max");
    }
}
