//! How long it takes to derive what a mission needs.

use std::time::Instant;

/// The value of `derive`; the debug log says how long it took.
pub fn timed<V>(what: &str, derive: impl FnOnce() -> V) -> V {
    let started = Instant::now();
    let value = derive();
    tracing::debug!(what, ms = 1e3 * started.elapsed().as_secs_f64(), "prepared");
    value
}
