//! The reader of the output ends first, as `head` does, or the disk of the logs is full.

use std::fs::OpenOptions;
use std::process::{Child, Stdio};

use super::program::{LIMIT, Serving, command, curionav, ready_line, signal, spawn_piped, turn, wait};

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

/// What a disk without room says to every byte.
fn full_disk() -> Stdio {
    OpenOptions::new().write(true).open("/dev/full").unwrap().into()
}

/// Starts `curionav` with logs that no program reads.
fn with_closed_logs(arguments: &[&str]) -> Child {
    let mut child = command(arguments).stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().unwrap();
    drop(child.stderr.take());
    child
}

fn with_full_disk(arguments: &[&str]) -> Child {
    command(arguments).stdout(Stdio::piped()).stderr(full_disk()).spawn().unwrap()
}

#[test]
fn logs_that_cannot_be_written_end_no_process() {
    let _turn = turn();
    for start in [with_closed_logs, with_full_disk] {
        for (arguments, status) in [
            (&["run", QUICK, "--log", "info"][..], 0),
            (&["scenario", "check", QUICK, "--log", "nonsense=nonsense"], 0),
            // Errors are told on standard error as well.
            (&["run", "nowhere.toml"], 2),
        ] {
            let ended = wait(&mut start(arguments), LIMIT).unwrap();
            assert_eq!(ended.code(), Some(status), "{arguments:?}");
        }
    }
}

#[test]
fn a_driver_whose_log_is_on_a_full_disk_lives() {
    let _turn = turn();
    let router = Serving::start(&["router", "--listen", "tcp/127.0.0.1:0"]);
    for start in [with_closed_logs, with_full_disk] {
        let arguments = ["driver", "--simulated-base", "--log", "debug", "--connect", router.endpoint()];
        let mut driver = start(&arguments);
        ready_line(driver.stdout.take().unwrap()).unwrap();
        signal("INT", driver.id());
        assert_eq!(wait(&mut driver, LIMIT).unwrap().code(), Some(0));
    }
}

#[test]
fn a_log_that_is_no_terminal_has_no_colours() {
    let output = curionav(&["run", QUICK, "--log", "debug"]);
    assert!(output.stderr.windows(4).any(|four| four == b"INFO" || four == b"EBUG"), "nothing was logged");
    assert!(!output.stderr.contains(&0x1b), "an escape sequence in a pipe");
}
