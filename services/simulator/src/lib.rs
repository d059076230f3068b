//! The simulator: takes a scenario in, plays the world it describes, and measures how the robot did.
//!
//! To the other services it is a robot: it gives `scan`, `odom` and `people` and takes `cmd`.

mod crowd;
mod inject;
mod record;
mod run;
mod service;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::process::{OnReady, Running};
use curionav_runtime::shutdown::Shutdown;
pub use inject::{InjectError, Prepared, prepare};
use zenoh::Session;

/// Simulates one world until `shutdown`; `on_ready` is called once it does.
pub fn run<'a>(
    config: &'a ServiceConfig,
    session: &'a Session,
    shutdown: Shutdown,
    on_ready: OnReady,
) -> Running<'a> {
    Box::pin(service::run(config, session, shutdown, on_ready))
}
