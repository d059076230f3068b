//! The simulated truth: scenario, pedestrians, lidar, robot plant, world and metrics.
//!
//! What the planner may not see lives here: where the robot really is, what noise its odometry and
//! laser got, who walks where. Pure: no files, no clock, no global randomness; a scenario, a map, the
//! recordings and a seed determine a run bit for bit. Only the simulator, the laboratory, the command
//! line and the tests import it.
//!
//! Read in this order: [`scenario`] (what is asked for), [`world`] (what happens, tick by tick, with
//! [`plant`], [`motion`] ([`walkers`] or [`hrvo`]), [`recorded`], [`lidar`] and [`perception`]), [`metrics`] and [`outcome`] (how it
//! went). The crate `curionav-lab` draws the scenes of the paper.

pub mod hrvo;
pub mod lidar;
pub mod metrics;
pub mod motion;
pub mod outcome;
pub mod perception;
pub mod plant;
pub mod recorded;
pub mod scenario;
pub mod walkers;
pub mod walls;
pub mod world;

pub use metrics::social::{SocialMetrics, SocialParams};
pub use metrics::track::Track;
pub use metrics::{Metrics, MetricsParams, Recorder};
pub use outcome::Outcome;
pub use recorded::{Recording, RecordingError};
pub use scenario::Scenario;
pub use world::{Observation, Truth, World};
