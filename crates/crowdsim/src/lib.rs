//! The simulated truth: scenario, pedestrians, lidar, robot plant, world and measures.
//!
//! What the planner may not see lives here: where the robot really is, what noise its odometry and
//! laser got, who walks where. Pure: no files, no clock, no global randomness; a scenario, a map, the
//! recordings and a seed determine a run bit for bit. Only the simulator, the laboratory, the command
//! line and the tests import it.
//!
//! Read in this order: [`scenario`] (what is asked for), [`world`] (what happens, tick by tick, with `crowds` (who is
//! drawn), `surroundings` with `things`, `plant`, `motion` (`walkers` or `avoiding`), `recorded`, `lidar` and
//! `perception`), [`measures`] and [`outcome`] (how it went). The crate `curionav-lab` draws the scenes of the paper.

mod avoiding;
mod beams;
mod crowds;
mod legs;
pub mod lidar;
mod maps;
pub mod measures;
mod motion;
pub mod outcome;
mod perception;
mod plant;
mod recorded;
pub mod scenario;
mod social_force;
mod surroundings;
mod things;
mod walkers;
mod walls;
pub mod world;

pub use maps::Maps;
pub use recorded::{Recording, RecordingError};
pub use scenario::Scenario;
pub use world::{Observation, Overlap, RecordedExtent, Touch, Truth, World};
