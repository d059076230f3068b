//! What turns pure code into services: configuration, sessions, typed topics and queries, maps by content and what is
//! derived from them, telemetry, and the conversion between wire and domain types.

pub mod byte_ring;
pub mod command;
pub mod command_log;
pub mod config;
pub mod convert;
pub mod cores;
pub mod denied;
pub mod echo;
pub mod endpoint;
pub mod environment;
pub mod exit;
pub mod fair_queue;
pub mod fields;
pub mod further_scans;
pub mod guard_settings;
pub mod heartbeat;
mod incoming;
pub mod kept_pose;
pub mod latency;
pub mod lease;
#[cfg(test)]
mod lease_tests;
pub mod locked;
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
pub mod robot_limits;
pub mod robot_service;
pub mod scanner_limits;
pub mod secure;
pub mod serve;
pub mod session;
mod session_error;
pub mod shutdown;
pub mod single_flight_cache;
pub mod status;
pub mod telemetry;
pub mod topic;
