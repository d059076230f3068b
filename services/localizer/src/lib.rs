//! The localizer: answers every tick of odometry and laser with a belief about the pose (AMCL).

mod glimpse;
mod service;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::process::{OnReady, Running};
use curionav_runtime::shutdown::Shutdown;
use zenoh::Session;

/// Localizes one robot until `shutdown`; `on_ready` is called once it does.
pub fn run<'a>(
    config: &'a ServiceConfig,
    session: &'a Session,
    shutdown: Shutdown,
    on_ready: OnReady,
) -> Running<'a> {
    Box::pin(service::run(config, session, shutdown, on_ready))
}
