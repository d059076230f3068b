//! The arbiter as a program of its own; `curionav arbiter` runs the same.

use curionav_runtime::process::service_main;

fn main() -> std::process::ExitCode {
    service_main("arbiter", curionav_arbiter::run)
}
