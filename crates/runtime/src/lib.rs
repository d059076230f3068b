//! What turns pure code into services: configuration, sessions, typed topics and queries, pools of
//! replicas, maps by content, and the conversion between wire and domain types.
//!
//! This is the only library that names Zenoh or touches files.

pub mod config;
pub mod convert;
pub mod echo;
pub mod evaluation_service;
pub mod evaluators;
pub mod fair_queue;
pub mod fields;
pub mod files;
pub mod generator;
pub mod latency;
pub mod lockstep;
pub mod map_store;
pub mod membership;
pub mod metrics;
pub mod metrics_endpoint;
pub mod probe;
pub mod process;
pub mod query;
pub mod ready;
pub mod robot_service;
pub mod serve;
pub mod session;
pub mod shutdown;
pub mod status;
pub mod telemetry;
pub mod topic;
pub mod warm;
pub mod zenoh_threads;
