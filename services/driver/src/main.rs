//! The driver as a program of its own; `curionav driver` runs the same.

fn main() -> std::process::ExitCode {
    curionav_runtime::process::service_main("driver", curionav_driver::run)
}
