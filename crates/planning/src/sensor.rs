//! The planar laser as the planner and the localiser model it.

use serde::{Deserialize, Serialize};

use crate::geometry::Pose2;

/// A planar scanner: equally spaced beams, counter-clockwise, the first at `-fov/2`.
/// Default: the paper's Sick laser as its map scale implies (180 degrees, 181 beams).
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct LaserModel {
    /// Where the scanner sits on the robot.
    pub robot_from_laser: Pose2,
    /// Field of view, radians; 2 pi means all around, the last beam next to the first.
    pub fov: f64,
    /// Number of beams, at least 2.
    pub beams: u32,
    /// Greatest range, metres; a beam that meets nothing reports this value.
    pub range_max: f64,
    /// Standard deviation of one range, metres.
    pub range_sigma: f64,
}

impl Default for LaserModel {
    fn default() -> Self {
        Self {
            robot_from_laser: Pose2::new(0.0, 0.0, 0.0),
            fov: std::f64::consts::PI,
            beams: 181,
            range_max: 5.0,
            range_sigma: 0.03,
        }
    }
}

impl LaserModel {
    /// Bearing of beam `i` in the laser frame, radians.
    pub fn bearing(&self, i: u32) -> f64 {
        let full = self.fov >= std::f64::consts::TAU - 1e-9;
        let gaps = if full { self.beams } else { self.beams - 1 };
        -0.5 * self.fov + self.fov * f64::from(i) / f64::from(gaps)
    }
}
