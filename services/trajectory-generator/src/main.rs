//! The generator as a program of its own; `curionav generator` runs the same.

fn main() -> std::process::ExitCode {
    curionav_runtime::process::service_main("generator", curionav_trajectory_generator::run)
}
