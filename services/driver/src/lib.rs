//! The driver: owns the mission, tracks decisions, and stops on anything missing, old or too close.
//!
//! The same driver moves a simulated and a real base: both take `cmd` and give `odom` and `scan`.

pub mod base_clock;
mod command_counts;
mod lease;
mod mission_keys;
mod service;
mod sight_of_mission;

pub use service::run;
