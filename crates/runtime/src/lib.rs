//! What turns pure code into services: configuration, sessions, typed topics and queries, maps over a session, and
//! telemetry. What needs no network of it is in `crates/mission`, and found here as well.

pub mod byte_ring;
pub mod command;
pub mod command_log;
pub mod config;
pub mod denied;
pub mod echo;
pub mod endpoint;
pub mod environment;
pub mod exit;
pub mod fair_queue;
pub mod further_scans;
pub mod heartbeat;
mod incoming;
pub mod kept_pose;
pub mod lease;
#[cfg(test)]
mod lease_tests;
pub mod lockstep;
pub mod map_store;
pub mod membership;
pub mod metrics;
pub mod metrics_endpoint;
pub mod mission_follower;
pub mod print;
pub mod probe;
pub mod process;
pub mod query;
pub mod ready;
pub mod robot_service;
pub mod secure;
pub mod serve;
pub mod session;
mod session_error;
pub mod shutdown;
pub mod status;
pub mod telemetry;
pub mod topic;

pub use curionav_mission::{
    convert, cores, fields, guard_settings, latency, locked, mission_course, robot_limits, scanner_limits,
    single_flight_cache,
};
