//! What a robot is: pose, footprint, limits of motion, laser, odometry noise.

use crate::F64Array;
use crate::check::{array, checks, count, length, non_negative, number, numbers, part, positive, within};
use crate::limits::{MAX_BEAMS, MAX_VERTICES};
use serde::{Deserialize, Serialize};
use strum::EnumDiscriminants;

/// Position (m) and heading (rad, counter-clockwise from x) in the frame its field names.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Metres.
    pub x: f64,
    /// Metres.
    pub y: f64,
    /// Radians.
    pub heading: f64,
}

checks! { pose: Pose {
    x, y, heading: number;
}}

/// Outline of the robot around its centre of rotation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, EnumDiscriminants)]
#[serde(tag = "kind", rename_all = "snake_case", try_from = "FootprintFields")]
#[strum_discriminants(name(FootprintKind), vis(), derive(Deserialize), serde(rename_all = "snake_case"))]
#[expect(missing_docs, reason = "the text of each outline says what its fields are")]
pub enum Footprint {
    /// A disc of this radius, m.
    Disc { radius: f64 },
    /// A polygon, in the robot frame, counter-clockwise: x and y of its three vertices or more, m.
    Polygon { x: F64Array, y: F64Array },
}

/// What is read of a footprint. Serde reads a tagged enum through a buffer, which cannot hold CBOR tags.
#[derive(Deserialize)]
struct FootprintFields {
    kind: FootprintKind,
    radius: Option<f64>,
    x: Option<F64Array>,
    y: Option<F64Array>,
}

impl TryFrom<FootprintFields> for Footprint {
    type Error = &'static str;

    fn try_from(fields: FootprintFields) -> Result<Self, Self::Error> {
        match (fields.kind, fields.radius, fields.x, fields.y) {
            (FootprintKind::Disc, Some(radius), ..) => Ok(Self::Disc { radius }),
            (FootprintKind::Polygon, _, Some(x), Some(y)) => Ok(Self::Polygon { x, y }),
            (FootprintKind::Disc, ..) => Err("a disc footprint needs `radius`"),
            (FootprintKind::Polygon, ..) => Err("a polygon footprint needs `x` and `y`"),
        }
    }
}

checks! { Footprint {
    Disc { radius: positive }
    Polygon {
        x: |field: &str, x: &F64Array| length(3, MAX_VERTICES)(field, x).and_then(|()| numbers(field, x)),
        y: array(x.len())
    }
}}

/// Shape and limits of motion of a unicycle robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RobotModel {
    /// Outline.
    pub footprint: Footprint,
    /// Largest speed, m/s.
    pub v_max: f64,
    /// Largest acceleration and deceleration, m/s^2.
    pub a_max: f64,
    /// Largest turn rate, rad/s.
    pub omega_max: f64,
    /// Largest change of turn rate, rad/s^2.
    pub alpha_max: f64,
    /// Largest speed backwards, m/s; 0 if the robot never drives backwards.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub v_reverse: f64,
}

fn is_zero(speed: &f64) -> bool {
    *speed == 0.0
}

checks! { robot: RobotModel {
    footprint: part;
    v_max, a_max, omega_max, alpha_max: positive;
    v_reverse: non_negative;
}}

/// A planar laser range finder.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct LaserModel {
    /// Pose of the laser in the robot frame.
    pub robot_from_laser: Pose,
    /// Field of view, rad, centred on the laser's heading; up to a full turn.
    pub fov: f64,
    /// Beams in a scan, 2 or more, equally spaced, counter-clockwise; over a full turn the last is beside the first.
    pub beams: u32,
    /// Range, m.
    pub range_max: f64,
    /// Standard deviation of a range, m.
    pub range_sigma: f64,
}

// The field of view may be a little more than a turn, so that a full turn survives rounding to single precision.
checks! { laser: LaserModel {
    robot_from_laser: part;
    fov, range_max: positive;
    range_sigma: non_negative;
    beams: count(2, MAX_BEAMS);
    fov: within(0.0, std::f64::consts::TAU + 1e-6);
}}

/// Odometry noise as variance per distance travelled, so that it does not depend on the step length.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct OdometryNoise {
    /// Variance of position per metre driven, m^2/m.
    pub position_per_metre: f64,
    /// Variance of position per radian turned, m^2/rad.
    pub position_per_radian: f64,
    /// Variance of heading per metre driven, rad^2/m.
    pub heading_per_metre: f64,
    /// Variance of heading per radian turned, rad^2/rad.
    pub heading_per_radian: f64,
}

checks! { noise: OdometryNoise {
    position_per_metre, position_per_radian, heading_per_metre, heading_per_radian: non_negative;
}}
