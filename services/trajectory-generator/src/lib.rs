//! The trajectory generator: grows a robot's tree and offers its branches as candidates (Alg. 1).
//!
//! Stateless: the tree comes with the request and goes with the reply, so any replica can take over.

use curionav_pool::generation_service;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::process::{OnReady, Running};
use curionav_runtime::shutdown::Shutdown;
use zenoh::Session;

/// Serves until `shutdown`; `on_ready` is called once requests are answered.
pub fn run<'a>(
    config: &'a ServiceConfig,
    session: &'a Session,
    shutdown: Shutdown,
    on_ready: OnReady,
) -> Running<'a> {
    Box::pin(generation_service::run(config, session, shutdown, on_ready))
}
