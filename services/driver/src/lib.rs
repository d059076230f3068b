//! The driver: owns the mission, tracks decisions, and stops on anything missing, old or too close.
//!
//! The same driver moves a simulated and a real base: both take `cmd` and give `odom` and `scan`.

pub mod base_clock;
mod command_counts;
pub mod control;
pub mod decision_fence;
pub mod guard;
mod lease;
mod lookout;
mod mission_keys;
pub mod mission_state;
pub mod seen_way;
mod service;
pub mod sight;
pub mod told;

pub use service::run;
