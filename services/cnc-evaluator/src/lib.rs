//! Curiosity for negative content: what each candidate costs people, by the human comfort and crowd density
//! map (eqs. 16 to 18).

use curionav_pool::evaluation_service;
use curionav_runtime::process::{Running, Start};

/// Serves the term `cnc`.
pub fn run(start: Start<'_>) -> Running<'_> {
    evaluation_service::run("cnc", start)
}
