//! A supervised service that starts long before its router.

use std::io::Write;
use std::process::{Child, Stdio};

use super::program::{LIMIT, command, lines, ready_line, turn};
use crate::soak::process::port_for_a_restart;

/// Ended when dropped.
struct Started(Child);

impl Drop for Started {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

fn start(arguments: &[&str]) -> Started {
    let mut command = command(arguments);
    let command = command.args(["--supervised", "--log", "warn"]).stdin(Stdio::piped());
    Started(command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap())
}

#[test]
fn a_supervised_service_waits_for_a_router_that_is_slow_to_start() {
    let _turn = turn();
    let endpoint = format!("tcp/127.0.0.1:{}", port_for_a_restart());
    let mut file = tempfile::Builder::new().suffix(".toml").tempfile().unwrap();
    writeln!(file, "connect_timeout_s = 0.3").unwrap();
    let config = file.path().to_str().unwrap();
    let mut arbiter = start(&["arbiter", "--config", config, "--connect", &endpoint]);
    // It has waited for three times as long as it would have, alone.
    let complaints = lines(arbiter.0.stderr.take().unwrap());
    let mut waited = 0;
    while waited < 3 {
        let line = complaints.recv_timeout(LIMIT).expect("it has ended, or hangs");
        waited += u32::from(line.contains("no router answered"));
    }
    let _router = start(&["router", "--listen", &endpoint]);
    let ready = ready_line(arbiter.0.stdout.take().unwrap()).unwrap();
    assert!(ready.contains("arbiter"), "{ready:?}");
}
