//! The simulator as a program of its own; `curionav simulator` runs the same.

fn main() -> std::process::ExitCode {
    curionav_runtime::process::service_main("simulator", curionav_simulator::run)
}
