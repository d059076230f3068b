//! Curiosity for positive content: what each candidate does to the certainty of the position (eqs. 7 to 15).

use curionav_pool::evaluation_service;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::process::{OnReady, Running};
use curionav_runtime::shutdown::Shutdown;
use zenoh::Session;

/// The term it serves, part of its keys.
pub const TERM: &str = "cpc";

/// Serves until `shutdown`; `on_ready` is called once requests are answered.
pub fn run<'a>(
    config: &'a ServiceConfig,
    session: &'a Session,
    shutdown: Shutdown,
    on_ready: OnReady,
) -> Running<'a> {
    Box::pin(evaluation_service::run(TERM, config, session, shutdown, on_ready))
}
