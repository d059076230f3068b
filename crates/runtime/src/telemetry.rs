//! Structured logs on standard error.

use std::time::Instant;

use tracing_subscriber::EnvFilter;

/// Installs the process's log subscriber once: `RUST_LOG` if set, else `default` (a filter such as
/// `info`). Zenoh's complaints about replies that come after their query has ended are kept out:
/// under load there is one for each late shard, and the arbiter counts them itself.
pub fn init(default: &str) {
    let filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| {
        EnvFilter::new(format!(
            "{default},zenoh=error,zenoh_transport=error,zenoh_link=error,zenoh::api::handlers=off"
        ))
    });
    // Already installed (tests): keep the first.
    let _ = tracing_subscriber::fmt().with_env_filter(filter).with_writer(std::io::stderr).try_init();
}

/// The value of `derive`; the debug log says how long it took.
pub fn timed<V>(what: &str, derive: impl FnOnce() -> V) -> V {
    let started = Instant::now();
    let value = derive();
    tracing::debug!(what, ms = 1e3 * started.elapsed().as_secs_f64(), "prepared");
    value
}
