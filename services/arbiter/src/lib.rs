//! The arbiter: asks for candidates and their costs, and decides.
//!
//! Read [`cycle::plan`] first.

pub mod cycle;
mod cycle_counts;
mod evaluation_stage;
mod generation_stage;
mod in_process;
mod obstacle_sensing;
pub mod readiness;
pub mod report;
mod service;

pub use service::run;
