//! The simulated truth: scenario, pedestrians, lidar, robot plant, world and metrics.
//!
//! What the planner may not see lives here: where the robot really is, what noise its odometry and
//! laser got, who walks where. Pure: no files, no clock, no global randomness; a scenario, a map, the
//! recordings and a seed determine a run bit for bit. Only the simulator, the command line and the
//! tests import it.
//!
//! Read in this order: [`scenario`] (what is asked for).

pub mod scenario;

pub use scenario::{Scenario, ScenarioError};
