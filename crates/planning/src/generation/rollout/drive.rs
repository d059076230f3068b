//! What a rollout starts from and how it is driven.

use crate::generation::path::Path;
use crate::geometry::{Pose2, Twist};
use crate::motion::RobotModel;

crate::parameters! {
    /// Parameters of the path-following law: pure pursuit (Coulter, 1992) with turning on the spot.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct RolloutParams {
        /// Longest step of integration, seconds: the driver's period, so that both move alike.
        pub substep: f64 [
            0.01, 1.0, "s", "shorter steps cost time and show nothing new;
            longer ones than the driver's move otherwise than it does"
        ] = 0.1,
        /// Distance of the pursued point at standstill, metres.
        pub lookahead: f64
            [0.05, 5.0, "m", "a nearer point makes the robot weave, a farther one cuts corners"] = 0.35,
        /// How much farther away the pursued point is per m/s of speed, seconds.
        pub lookahead_time: f64 [0.0, 5.0, "s", "a farther point cuts corners"] = 0.4,
        /// Beyond this bearing of the pursued point the robot turns on the spot, radians.
        pub turn_from: f64
            [0.01, 3.15, "rad", "no bearing is greater than half a turn; at 0 the robot never drives"] = 1.2,
        /// A turn that comes first ends at this bearing, radians.
        pub turn_until: f64
            [0.01, 3.15, "rad", "no bearing is greater than half a turn; at 0 a turn never ends"] = 0.25,
        /// Share of the greatest turn rate a path's bends may use; the rest is for corrections.
        pub turn_share: f64 [0.01, 1.0, "", "it is a share, and without any the robot never turns"] = 0.9,
    }
}

/// How a path is to be driven.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SpeedProfile {
    /// Cruising speed as a fraction of the greatest.
    pub fraction: f64,
    /// Whether the robot first turns on the spot towards the path.
    pub turn_first: bool,
}

/// What a rollout starts from and how long it lasts.
#[derive(Debug, Clone, Copy)]
pub struct Departure<'a> {
    /// Where the robot is.
    pub pose: Pose2,
    /// How it moves.
    pub twist: Twist,
    /// What it can do.
    pub robot: &'a RobotModel,
    /// Number of states, at least 1.
    pub steps: usize,
    /// Seconds between states.
    pub dt: f64,
}

/// A path and how it is to be driven.
#[derive(Debug, Clone, Copy)]
pub struct Drive<'a> {
    /// Where along.
    pub path: &'a Path,
    /// How fast.
    pub profile: SpeedProfile,
}
