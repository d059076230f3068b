//! What a term's evaluator is made for.

use crate::geometry::Point2;
use crate::motion::{OdometryNoise, RobotModel};
use crate::sensor::LaserModel;

/// What stays the same from one cycle of a mission to the next, apart from map and parameters.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Task {
    /// Where to go, map frame.
    pub goal: Point2,
    /// Heading to end with, map frame, radians; none if any will do.
    pub goal_heading: Option<f64>,
    /// What the base can do.
    pub robot: RobotModel,
    /// What the localiser sees with.
    pub laser: LaserModel,
    /// What odometry misses.
    pub noise: OdometryNoise,
}
