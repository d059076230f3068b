//! The localizer as a program of its own; `curionav localizer` runs the same.

use curionav_runtime::process::service_main;

fn main() -> std::process::ExitCode {
    service_main("localizer", curionav_localizer::run)
}
