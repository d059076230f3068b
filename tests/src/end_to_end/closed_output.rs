//! The reader of the output ends first, as `head` does.

use super::program::{spawn_piped, turn};

const QUICK: &str = "scenarios/quickstart.toml";

#[test]
fn a_reader_that_ends_first_is_no_failure() {
    let _turn = turn();
    let check = ["scenario", "check", QUICK];
    for arguments in [&["scenario", "reference"][..], &check, &["run", QUICK], &["run", QUICK, "--json"]] {
        let mut child = spawn_piped(arguments);
        drop(child.stdout.take());
        let output = child.wait_with_output().unwrap();
        let error = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success() && !error.contains("panicked"), "{arguments:?}: {error}");
    }
}
