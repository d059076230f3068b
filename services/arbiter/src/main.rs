//! The arbiter as a program of its own; `curionav arbiter` runs the same.

fn main() -> std::process::ExitCode {
    curionav_runtime::process::service_main("arbiter", curionav_arbiter::run)
}
