//! The driver: owns the mission, tracks decisions, and stops on anything missing, old or too close.
//!
//! The same driver moves a simulated and a real base: both take `cmd` and give `odom` and `scan`.

mod command_counts;
pub mod control;
pub mod desk;
mod mission_key;
pub mod obedience;
pub mod proximity;
mod service;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::process::{OnReady, Running};
use curionav_runtime::shutdown::Shutdown;
use zenoh::Session;

/// Drives one robot until `shutdown`; `on_ready` is called once it does.
pub fn run<'a>(
    config: &'a ServiceConfig,
    session: &'a Session,
    shutdown: Shutdown,
    on_ready: OnReady,
) -> Running<'a> {
    Box::pin(service::run(config, session, shutdown, on_ready))
}
