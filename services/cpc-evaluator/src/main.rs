//! The cpc as a program of its own; `curionav cpc` runs the same.

fn main() -> std::process::ExitCode {
    curionav_runtime::process::service_main("cpc", curionav_cpc_evaluator::run)
}
