//! The unicycle: state, limits, exact motion over a step, and odometry noise (eqs. 1 and 7).

use nalgebra::{Matrix3, Vector3};
use serde::{Deserialize, Serialize};

use crate::geometry::{Point2, Pose2, Twist, wrap_angle};
use crate::numerics::sin_cos;

/// The robot's outline in its own frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase", tag = "shape", deny_unknown_fields)]
pub enum Footprint {
    /// A disc around the robot's centre.
    Disc {
        /// Metres.
        radius: f64,
    },
    /// A convex polygon, counter-clockwise vertices in the robot frame.
    Polygon {
        /// Metres; at least three.
        vertices: Vec<Point2>,
    },
}

impl Footprint {
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

/// What the base can do (A27): a disc of 0.3 m, 0..1 m/s, 0.5 m/s2.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct RobotModel {
    /// Outline used for collision checks.
    pub footprint: Footprint,
    /// Greatest forward speed, m/s.
    pub v_max: f64,
    /// Greatest acceleration and braking, m/s2.
    pub a_max: f64,
    /// Greatest turn rate, rad/s.
    pub omega_max: f64,
    /// Greatest change of turn rate, rad/s2.
    pub alpha_max: f64,
}

impl Default for RobotModel {
    fn default() -> Self {
        Self {
            footprint: Footprint::Disc { radius: 0.3 },
            v_max: 1.0,
            a_max: 0.5,
            omega_max: 1.0,
            alpha_max: 1.0,
        }
    }
}

impl RobotModel {
    /// Circumscribed radius of the footprint, metres.
    pub fn radius(&self) -> f64 {
        self.footprint.circumscribed_radius()
    }

    /// The twist reached after `dt` seconds when `wanted` is asked for: clipped to the speed limits and
    /// to what acceleration allows from `current`. Never backwards.
    pub fn limit(&self, current: Twist, wanted: Twist, dt: f64) -> Twist {
        let v = wanted.v.clamp(current.v - self.a_max * dt, current.v + self.a_max * dt);
        let omega =
            wanted.omega.clamp(current.omega - self.alpha_max * dt, current.omega + self.alpha_max * dt);
        Twist { v: v.clamp(0.0, self.v_max), omega: omega.clamp(-self.omega_max, self.omega_max) }
    }

    /// Distance needed to stop from `v` m/s at full braking, metres.
    pub fn stopping_distance(&self, v: f64) -> f64 {
        v * v / (2.0 * self.a_max)
    }
}

/// Pose after `dt` seconds at a constant twist: the exact arc.
pub fn step(pose: Pose2, twist: Twist, dt: f64) -> Pose2 {
    let turn = twist.omega * dt;
    let travel = twist.v * dt;
    // Chord of the arc: its length is travel * sinc(turn/2), its direction the mean heading.
    let half = 0.5 * turn;
    let chord =
        if half.abs() < 1e-6 { travel * (1.0 - half * half / 6.0) } else { travel * sin_cos(half).0 / half };
    let (s, c) = sin_cos(pose.heading + half);
    Pose2::new(pose.x + chord * c, pose.y + chord * s, wrap_angle(pose.heading + turn))
}

/// Odometry noise as variances per metre and per radian travelled, so that it does not depend on the
/// step length (D6). The plant, the localiser and CPC's `M'` (eq. 7) share these four numbers.
///
/// The defaults are 0.2 m standard deviation after 10 m and 5 degrees after a full turn.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct OdometryNoise {
    /// Variance of position per metre travelled, on each robot axis, m2/m.
    pub position_per_metre: f64,
    /// Variance of position per radian turned, on each robot axis, m2/rad.
    pub position_per_radian: f64,
    /// Variance of heading per metre travelled, rad2/m.
    pub heading_per_metre: f64,
    /// Variance of heading per radian turned, rad2/rad.
    pub heading_per_radian: f64,
}

impl Default for OdometryNoise {
    fn default() -> Self {
        Self {
            position_per_metre: 0.004,
            position_per_radian: 0.0001,
            heading_per_metre: 0.0005,
            heading_per_radian: 0.0012,
        }
    }
}

impl OdometryNoise {
    /// Variances (along, across, heading) in the robot frame of one motion increment of `travel`
    /// metres and `turn` radians (either sign).
    pub fn variances(&self, travel: f64, turn: f64) -> Vector3<f64> {
        let (d, a) = (travel.abs(), turn.abs());
        let position = self.position_per_metre * d + self.position_per_radian * a;
        Vector3::new(position, position, self.heading_per_metre * d + self.heading_per_radian * a)
    }

    /// The process noise `M'` of eq. 7 in the map frame. The position part is isotropic, so it does
    /// not depend on the heading.
    pub fn process_covariance(&self, travel: f64, turn: f64) -> Matrix3<f64> {
        Matrix3::from_diagonal(&self.variances(travel, turn))
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
}
