//! The driver as a program of its own; `curionav driver` runs the same.

use curionav_runtime::process::service_main;

fn main() -> std::process::ExitCode {
    service_main("driver", curionav_driver::run)
}
