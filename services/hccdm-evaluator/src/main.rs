//! The hccdm as a program of its own; `curionav hccdm` runs the same.

use curionav_runtime::process::service_main;

fn main() -> std::process::ExitCode {
    service_main("hccdm", curionav_hccdm_evaluator::run)
}
