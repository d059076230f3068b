//! The cpc as a program of its own; `curionav cpc` runs the same.

use curionav_runtime::process::service_main;

fn main() -> std::process::ExitCode {
    service_main("cpc", curionav_cpc_evaluator::run)
}
