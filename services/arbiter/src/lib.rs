//! The arbiter: asks for candidates and their costs, and decides.
//!
//! Read [`cycle::plan`] first.

pub mod cycle;
mod cycle_counts;
mod evaluation_stage;
mod generation_stage;
mod in_process;
pub mod memory;
pub mod muster;
pub mod report;
mod service;
pub mod succession;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::process::{OnReady, Running};
use curionav_runtime::shutdown::Shutdown;
use zenoh::Session;

/// Serves one robot until `shutdown`; `on_ready` is called once it does.
pub fn run<'a>(
    config: &'a ServiceConfig,
    session: &'a Session,
    shutdown: Shutdown,
    on_ready: OnReady,
) -> Running<'a> {
    Box::pin(service::run(config, session, shutdown, on_ready))
}
