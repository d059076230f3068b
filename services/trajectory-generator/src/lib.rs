//! The trajectory generator: grows a robot's tree and offers its branches as candidates (Alg. 1).
//!
//! Stateless: the tree comes with the request and goes with the reply, so any replica can take over. Where the
//! configuration names a planner of one's own, that is served in the place of the built-in generators.

use curionav_pool::{generator, own_planner_service};
use curionav_runtime::process::{Running, Start};

/// Serves until the end is asked for.
pub fn run(start: Start<'_>) -> Running<'_> {
    match start.config.planner.clone() {
        Some(planner) => own_planner_service::run(planner, start),
        None => generator::run(start),
    }
}
