//! The reader of the output ends first, as `head` does.

use std::process::{Command, Stdio};

use super::program::{program, root, turn};

const QUICK: &str = "scenarios/quickstart.toml";

#[test]
fn a_reader_that_ends_first_is_no_failure() {
    let _turn = turn();
    let check = ["scenario", "check", QUICK];
    for arguments in [&["scenario", "reference"][..], &check, &["run", QUICK], &["run", QUICK, "--json"]] {
        let mut child = Command::new(program())
            .args(arguments)
            .current_dir(root())
            .env_remove("RUST_LOG")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !error.contains("panicked"), "{arguments:?}: {error}");
    }
}
