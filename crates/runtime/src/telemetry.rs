//! Structured logs on standard error.

use std::io::{IsTerminal, Write};

use tracing_subscriber::EnvFilter;

use crate::command_log;
use crate::print::note;

pub use curionav_mission::timed::timed;

/// What is logged if the filter that was given cannot be read.
const FALLBACK: &str = "warn";

/// Installs the process's log subscriber once: `RUST_LOG` if set, else `default` (a filter such as
/// `info`). Zenoh's complaints about replies that come after their query has ended are kept out:
/// under load there is one for each late shard, and the arbiter counts them itself.
///
/// A service also logs every command that it is given, whatever the filter says (`is_service`).
///
/// Lines that standard error does not take are lost. Colours are for terminals alone.
pub fn init(default: &str, is_service: bool) {
    let mut filter = EnvFilter::try_from_default_env().unwrap_or_else(|_| filter(default));
    if is_service && let Ok(commands) = format!("{}=info", command_log::TARGET).parse() {
        filter = filter.add_directive(commands);
    }
    let is_coloured = std::io::stderr().is_terminal() && std::env::var_os("NO_COLOR").is_none();
    // Already installed (tests): keep the first. The subscriber must not report its own errors: it would do so with
    // `eprintln!`, which panics where logs cannot be written.
    let _ = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_ansi(is_coloured)
        .with_writer(|| LossyStderr)
        .log_internal_errors(false)
        .try_init();
}

fn filter(wanted: &str) -> EnvFilter {
    let whole = |filter: &str| {
        format!("{filter},zenoh=error,zenoh_transport=error,zenoh_link=error,zenoh::api::handlers=off")
    };
    EnvFilter::try_new(whole(wanted)).unwrap_or_else(|error| {
        note(format_args!("--log: `{wanted}` is no filter ({error}); {FALLBACK} is logged instead"));
        EnvFilter::try_new(whole(FALLBACK)).unwrap_or_default()
    })
}

/// Standard error that takes everything: on a full disk or a closed pipe lines are lost, never the process.
struct LossyStderr;

impl Write for LossyStderr {
    fn write(&mut self, bytes: &[u8]) -> std::io::Result<usize> {
        let _ = std::io::stderr().write_all(bytes);
        Ok(bytes.len())
    }

    fn flush(&mut self) -> std::io::Result<()> {
        Ok(())
    }
}
