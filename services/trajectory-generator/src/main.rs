//! The generator as a program of its own; `curionav generator` runs the same.

use curionav_runtime::process::service_main;

fn main() -> std::process::ExitCode {
    service_main("generator", curionav_trajectory_generator::run)
}
