//! The simulator as a program of its own; `curionav simulator` runs the same.

use curionav_runtime::process::service_main;

fn main() -> std::process::ExitCode {
    service_main("simulator", curionav_simulator::run)
}
