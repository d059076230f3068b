//! A mission without a network: wire types and domain types meet in [`convert`](mod@convert), [`fields`] keeps maps and
//! what is derived from them, [`mission_course`] makes a mission ready to plan, and [`robot_limits`] bounds it.
//!
//! Services use it through `crates/runtime`, which adds sessions. What plays a scenario in one thread uses it alone.

pub mod convert;
pub mod cores;
pub mod fields;
pub mod guard_settings;
pub mod latency;
pub mod locked;
pub mod map_store;
pub mod mission_course;
pub mod robot_limits;
pub mod scanner_limits;
pub mod single_flight_cache;
pub mod ticks;
pub mod timed;
