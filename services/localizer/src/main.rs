//! The localizer as a program of its own; `curionav localizer` runs the same.

use curionav_runtime::process::service_main;

fn main() -> std::process::ExitCode {
    service_main("localizer", async |config, session, shutdown, on_ready| {
        curionav_localizer::run(config, session, shutdown, on_ready).await
    })
}
