//! Curiosity for positive content: what each candidate does to the certainty of the position (eqs. 7 to 15).

use curionav_pool::evaluation_service;
use curionav_runtime::process::{Running, Start};

/// Serves the term `cpc`.
pub fn run(start: Start<'_>) -> Running<'_> {
    evaluation_service::run("cpc", start)
}

/// Serves the term `cpc-occluded`: the same where people hide landmarks.
pub fn run_occluded(start: Start<'_>) -> Running<'_> {
    evaluation_service::run("cpc-occluded", start)
}
