//! What a robot is: pose, footprint, limits of motion, laser, odometry noise.

use crate::array::F64Array;
use crate::check;
use crate::limits::{MAX_BEAMS, MAX_VERTICES};
use crate::message::Validate;
use crate::reject::Reject;
use serde::{Deserialize, Serialize};

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

impl Validate for Pose {
    fn validate(&self) -> Result<(), Reject> {
        check::numbers(&[("x", self.x), ("y", self.y), ("heading", self.heading)])
    }
}

/// Outline of the robot around its centre of rotation.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "FootprintWire", into = "FootprintWire")]
pub enum Footprint {
    /// A disc.
    Disc {
        /// Metres.
        radius: f64,
    },
    /// A polygon, in the robot frame, counter-clockwise, three vertices or more.
    Polygon {
        /// Metres, one a vertex.
        x: F64Array,
        /// Metres, one a vertex.
        y: F64Array,
    },
}

/// The map a footprint is on the wire. Serde's own tagged enums cannot hold CBOR tags.
#[derive(Serialize, Deserialize)]
struct FootprintWire {
    kind: FootprintKind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    radius: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    x: Option<F64Array>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    y: Option<F64Array>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum FootprintKind {
    Disc,
    Polygon,
}

impl From<Footprint> for FootprintWire {
    fn from(footprint: Footprint) -> Self {
        match footprint {
            Footprint::Disc { radius } => {
                Self { kind: FootprintKind::Disc, radius: Some(radius), x: None, y: None }
            }
            Footprint::Polygon { x, y } => {
                Self { kind: FootprintKind::Polygon, radius: None, x: Some(x), y: Some(y) }
            }
        }
    }
}

impl TryFrom<FootprintWire> for Footprint {
    type Error = &'static str;

    fn try_from(wire: FootprintWire) -> Result<Self, Self::Error> {
        match (wire.kind, wire.radius, wire.x, wire.y) {
            (FootprintKind::Disc, Some(radius), _, _) => Ok(Self::Disc { radius }),
            (FootprintKind::Polygon, _, Some(x), Some(y)) => Ok(Self::Polygon { x, y }),
            (FootprintKind::Disc, ..) => Err("a disc footprint needs `radius`"),
            (FootprintKind::Polygon, ..) => Err("a polygon footprint needs `x` and `y`"),
        }
    }
}

impl Validate for Footprint {
    fn validate(&self) -> Result<(), Reject> {
        match self {
            Self::Disc { radius } => check::positive(&[("radius", *radius)]),
            Self::Polygon { x, y } => {
                check::at_most("x", x.len(), MAX_VERTICES)?;
                check::at_least("x", x.len(), 3)?;
                check::arrays(x.len(), &[("x", x), ("y", y)])
            }
        }
    }
}

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
}

impl Validate for RobotModel {
    fn validate(&self) -> Result<(), Reject> {
        check::part("footprint", &self.footprint)?;
        check::positive(&[
            ("v_max", self.v_max),
            ("a_max", self.a_max),
            ("omega_max", self.omega_max),
            ("alpha_max", self.alpha_max),
        ])
    }
}

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

impl Validate for LaserModel {
    fn validate(&self) -> Result<(), Reject> {
        check::part("robot_from_laser", &self.robot_from_laser)?;
        check::positive(&[("fov", self.fov), ("range_max", self.range_max)])?;
        check::non_negative(&[("range_sigma", self.range_sigma)])?;
        check::at_most("beams", self.beams as usize, MAX_BEAMS)?;
        check::at_least("beams", self.beams as usize, 2)?;
        // A little more than a turn, so that a full turn survives rounding to single precision.
        check::within("fov", self.fov, 0.0, std::f64::consts::TAU + 1e-6)
    }
}

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

impl Validate for OdometryNoise {
    fn validate(&self) -> Result<(), Reject> {
        check::non_negative(&[
            ("position_per_metre", self.position_per_metre),
            ("position_per_radian", self.position_per_radian),
            ("heading_per_metre", self.heading_per_metre),
            ("heading_per_radian", self.heading_per_radian),
        ])
    }
}
