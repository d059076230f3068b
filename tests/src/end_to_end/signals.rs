//! A signal ends any command soon, whatever it computes.

use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use super::program::{Deployment, LIMIT, curionav, is_alive, program, root, signal, turn, wait};
use crate::every_number::children;

/// A planner whose cycles take seconds: every one of its trees is as large as a profile may ask for.
const HEAVY: &str = "name = \"heavy\"\ntrees = 8\n[generation.tree]\niterations = 10000\nwarm_up = 10000\n\
    max_nodes = 8000\neta = 20.0\nmax_edge = 20.0\ngamma = 1000.0\nspacing = 0.01\ndisc_margin = 50.0\n";

const SPACE: &str =
    "base = \"heavy.toml\"\n[[parameters]]\npath = \"terms.cnc.weight\"\nlow = 1.0\nhigh = 2.0\n";

fn start(folder: &Path, arguments: &[&str]) -> Child {
    Command::new(program())
        .args(arguments)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Clock ticks of processor time that a process and its children have taken.
fn worked(pid: u32) -> u64 {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // After the name in brackets: the 12th and 13th number are the ticks in user and system mode.
    let numbers = stat.rsplit(')').next().unwrap_or_default().split_whitespace();
    let own: u64 = numbers.skip(11).take(2).filter_map(|n| n.parse::<u64>().ok()).sum();
    own + children(pid).into_iter().map(worked).sum::<u64>()
}

#[test]
fn a_signal_ends_a_command_while_it_computes() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("heavy.toml"), HEAVY).unwrap();
    std::fs::write(folder.path().join("space.toml"), SPACE).unwrap();
    let scenario = root().join("scenarios/quickstart.toml");
    let scenario = scenario.to_str().unwrap();
    // Two seconds, and as much as starting a trivial command shows this machine to be slow.
    let begin = Instant::now();
    assert!(curionav(&["scenario", "check", scenario]).status.success());
    let limit = Duration::from_secs(2) + 20 * begin.elapsed();
    for arguments in [
        &["run", scenario, "--planner", "heavy.toml"][..],
        &["bench", "--planners", "heavy.toml", "--scenarios", scenario, "--out", "bench"],
        &["tune", "space.toml", "--scenarios", scenario, "--out", "tune"],
    ] {
        for signal in ["-TERM", "-INT"] {
            let mut child = start(folder.path(), arguments);
            let pid = child.id();
            let begin = Instant::now();
            // Three seconds of work: start and preparation take less.
            while worked(pid) < 300 {
                assert!(child.try_wait().unwrap().is_none(), "{arguments:?} ended before the signal");
                assert!(begin.elapsed() < LIMIT, "{arguments:?} computes nothing");
                std::thread::sleep(Duration::from_millis(20));
            }
            let workers = children(pid);
            assert!(Command::new("kill").args([signal, &pid.to_string()]).status().unwrap().success());
            let begin = Instant::now();
            let ended = wait(&mut child, limit);
            let took = begin.elapsed();
            assert!(
                ended.is_some_and(|status| !status.success()),
                "{arguments:?} goes on {took:?} after {signal}"
            );
            while workers.iter().any(|worker| is_alive(*worker)) {
                assert!(begin.elapsed() < limit, "{arguments:?}: a worker goes on after {signal}");
                std::thread::sleep(Duration::from_millis(20));
            }
            println!("{} ended {:.2} s after {signal}", arguments[0], took.as_secs_f64());
        }
    }
}

#[test]
fn what_hangs_does_not_outlive_the_deployment() {
    let _turn = turn();
    let deployment = Deployment::start(1);
    let driver = deployment.pid("driver-0");
    signal("STOP", driver);
    assert_eq!(deployment.stop(), 0);
    assert!(!is_alive(driver));
}
