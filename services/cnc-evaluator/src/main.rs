//! The cnc as a program of its own; `curionav cnc` runs the same.

fn main() -> std::process::ExitCode {
    curionav_runtime::process::service_main("cnc", curionav_cnc_evaluator::run)
}
