//! The cpc as a program of its own; `curionav cpc` runs the same.

use curionav_runtime::process::service_main;

fn main() -> std::process::ExitCode {
    service_main("cpc", async |config, session, shutdown, on_ready| {
        curionav_cpc_evaluator::run(config, session, shutdown, on_ready).await
    })
}
