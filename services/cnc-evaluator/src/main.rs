//! The cnc as a program of its own; `curionav cnc` runs the same.

use curionav_runtime::process::service_main;

fn main() -> std::process::ExitCode {
    service_main("cnc", curionav_cnc_evaluator::run)
}
