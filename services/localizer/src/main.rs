//! The localizer as a program of its own; `curionav localizer` runs the same.

fn main() -> std::process::ExitCode {
    curionav_runtime::process::service_main("localizer", curionav_localizer::run)
}
