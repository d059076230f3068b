//! `curionav bench` and `curionav tune` on the small scenario.

use std::os::unix::fs::PermissionsExt as _;
use std::path::Path;
use std::process::Command;

use super::program::{comes_true, command, curionav, program, root, spawn, turn};

const QUICK: &str = "scenarios/quickstart.toml";

fn arguments<'a>(out: &'a Path, jobs: &'a str) -> Vec<&'a str> {
    let out = out.to_str().unwrap();
    let what = ["bench", "--scenarios", QUICK, "--planners", "curiosity,cnc-only", "--jobs", jobs];
    [&what[..], &["--first-seed", "1001", "--repeats", "2", "--out", out]].concat()
}

fn bench(out: &Path, jobs: &str) -> String {
    let output = curionav(&arguments(out, jobs));
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    std::fs::read_to_string(out.join("results.csv")).unwrap()
}

#[test]
fn results_do_not_depend_on_the_number_of_workers() {
    let _turn = turn();
    let (one, two) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let results = bench(one.path(), "1");
    assert_eq!(results, bench(two.path(), "2"));
    assert_eq!(results.lines().count(), 1 + 4);
    let single = super::program::run(QUICK, &["--seed", "1002", "--planner", "cnc-only"]).0;
    let digest = format!(",{},", single.decisions_sha256);
    assert!(results.lines().nth(4).unwrap().contains(&digest), "{results}");
    let made = std::fs::read_to_string(one.path().join("bench.json")).unwrap();
    let made: serde_json::Value = serde_json::from_str(&made).unwrap();
    assert_eq!(made["planners"][1]["name"], "cnc-only");
    let numbers = ["first_seed", "repeats", "workers"].map(|field| made[field].as_u64());
    assert_eq!(numbers, [1001, 2, 1].map(Some));
    assert_eq!(made["scenarios"][0]["name"], "quickstart");
}

#[test]
fn a_kill_costs_no_finished_run_and_changes_no_result() {
    let _turn = turn();
    let (whole, killed) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let journal = killed.path().join("journal.jsonl");
    let rows = || std::fs::read(&journal).map_or(0, |b| b.iter().filter(|b| **b == b'\n').count());
    let mut child = spawn(&arguments(killed.path(), "1"));
    assert!(comes_true(|| rows() > 0), "no run was finished");
    child.kill().unwrap();
    child.wait().unwrap();
    let kept = std::fs::read_to_string(&journal).unwrap();
    std::fs::write(&journal, format!("{kept}{}", r#"{"key":"cut o"#)).unwrap();
    assert_eq!(bench(killed.path(), "2"), bench(whole.path(), "2"));
    // What was finished before the kill was not run again, and what was cut off is gone.
    let after = std::fs::read_to_string(&journal).unwrap();
    assert!(after.starts_with(&kept) && after.lines().count() == 4, "{after}");
}

#[test]
fn parts_that_slurm_spreads_merge_to_what_one_machine_writes() {
    let _turn = turn();
    let (whole, parts) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let scenario = root().join(QUICK);
    let path = std::env::join_paths(
        std::iter::once(program().parent().unwrap().to_owned())
            .chain(std::env::split_paths(&std::env::var_os("PATH").unwrap())),
    );
    let part = |index: &str| {
        let mut slurm = Command::new("bash");
        slurm.arg(root().join("deploy/bench.slurm")).args([
            "--planners",
            "curiosity,cnc-only",
            "--repeats",
            "2",
        ]);
        slurm.args(["--first-seed", "1001", "--scenarios"]).arg(&scenario).current_dir(parts.path());
        slurm.env("PATH", path.as_ref().unwrap()).env("SLURM_CPUS_PER_TASK", "1");
        slurm.env("SLURM_ARRAY_TASK_ID", index).env("SLURM_ARRAY_TASK_COUNT", "3");
        let output = slurm.output().unwrap();
        assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    };
    let merge = || {
        let folder = |index: u32| parts.path().join(format!("out/bench-parts/{index}")).display().to_string();
        let (folders, out) = ([1, 2, 3].map(folder), parts.path().join("merged"));
        let [one, two, three] = folders.each_ref().map(String::as_str);
        let output = curionav(&["bench", "merge", one, two, three, "--out", out.to_str().unwrap()]);
        (output, out)
    };
    part("1");
    part("2");
    let (output, _) = merge();
    assert_eq!(
        output.status.code(),
        Some(2),
        "a part is missing: {}",
        String::from_utf8_lossy(&output.stderr)
    );
    part("3");
    let (output, out) = merge();
    assert_eq!(output.status.code(), Some(0), "{}", String::from_utf8_lossy(&output.stderr));
    assert_eq!(std::fs::read_to_string(out.join("results.csv")).unwrap(), bench(whole.path(), "2"));
}

/// `curionav bench` with `script` in the place of a Python interpreter.
fn bench_with(script: &str, out: &Path, more: &[&str]) -> (Option<i32>, String, String) {
    let python = out.join("python");
    std::fs::write(&python, format!("#!/bin/sh\n{script}\n")).unwrap();
    std::fs::set_permissions(&python, std::fs::Permissions::from_mode(0o755)).unwrap();
    let folder = out.join("bench");
    let mut program = command(&[&arguments(&folder, "2")[..], more].concat());
    let output = program.env("CURIONAV_PYTHON", &python).output().unwrap();
    let text = |bytes| String::from_utf8(bytes).unwrap();
    (output.status.code(), text(output.stdout), text(output.stderr))
}

#[test]
fn the_python_package_is_called_at_the_end_and_its_verdict_is_the_exit_status() {
    let _turn = turn();
    let out = tempfile::tempdir().unwrap();
    let claims = out.path().join("claims.toml");
    let check = ["--check", claims.to_str().unwrap()];
    let package = |checked: &str, judged: &str| {
        format!("case \"$*\" in -c*) ;; *--check-only) {checked} ;; *) echo \"$*\"; {judged} ;; esac")
    };
    let refused = "echo line 3 of the claims is wrong >&2; exit 2";
    let (status, _, said) = bench_with(&package(refused, "exit 0"), out.path(), &check);
    assert_eq!(status, Some(2));
    assert!(said.contains("--check: line 3 of the claims is wrong"), "{said}");
    assert!(!out.path().join("bench/results.csv").exists(), "something was run");
    for (judged, expected) in [("exit 0", 0), ("exit 1", 1), ("exit 2", 1)] {
        let (status, text, said) = bench_with(&package("exit 0", judged), out.path(), &check);
        assert_eq!(status, Some(expected), "{said}");
        let called = format!("-m curionav.report {}", out.path().join("bench").display());
        assert!(text.lines().any(|line| line == called), "{text}");
        assert!(text.contains("cnc-only       2 of 2 at the goal without collision"), "{text}");
    }
    let made = std::fs::read_to_string(out.path().join("bench/bench.json")).unwrap();
    assert!(made.contains(check[1]), "a report that is written again judges the same claims");
}

#[test]
fn a_bench_without_the_python_package_ends_well_unless_there_are_claims() {
    let _turn = turn();
    let out = tempfile::tempdir().unwrap();
    let none = "echo No module named curionav >&2; exit 1";
    let (status, _, said) = bench_with(none, out.path(), &["--check", "claims.toml"]);
    assert_eq!(status, Some(1));
    assert!(said.contains("--check: ") && said.contains("No module named curionav"), "{said}");
    assert!(!out.path().join("bench/results.csv").exists(), "something was run");
    let (status, text, said) = bench_with(none, out.path(), &[]);
    assert_eq!(status, Some(0), "{said}");
    let last = text.lines().last().unwrap();
    assert!(last.contains("pip install './python[report]'"), "{text}");
    assert!(last.contains("python3 -m curionav.report "), "{text}");
    assert!(out.path().join("bench/results.csv").exists());
}

#[test]
fn bad_input_is_told_before_anything_runs() {
    let _turn = turn();
    let out = tempfile::tempdir().unwrap();
    let out = out.path().to_str().unwrap();
    for (more, said) in [
        (["--planners", "curiosity,unknown"], "unknown planner `unknown`"),
        (["--scenarios", "scenarios/nothing-*.toml"], "no file is called"),
        (["--repeats", "0"], "--repeats"),
    ] {
        let output = curionav(&[&["bench", "--out", out], &more[..]].concat());
        let text = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(2), "{more:?}: {text}");
        assert!(text.contains(said), "{more:?}: {text}");
    }
}

#[test]
fn tuning_prints_a_profile_that_runs_and_keeps_off_the_reported_seeds() {
    let _turn = turn();
    let out = tempfile::tempdir().unwrap();
    let space = out.path().join("space.toml");
    let text = "base = \"curiosity\"\n[[parameters]]\npath = \"terms.cnc.weight\"\nlow = 0.3\nhigh = 3.0\nscale = \"log\"\n";
    std::fs::write(&space, text).unwrap();
    let folder = out.path().join("tune");
    let what = ["tune", space.to_str().unwrap(), "--scenarios", QUICK, "--out", folder.to_str().unwrap()];
    let tune = |more: &[&str]| curionav(&[&what[..], more].concat());
    let refused = tune(&["--first-seed", "7"]);
    assert_eq!(refused.status.code(), Some(2));
    let small = ["--settings", "3", "--repeats", "1", "--rounds", "1"];
    let found = tune(&small);
    assert_eq!(found.status.code(), Some(0), "{}", String::from_utf8_lossy(&found.stderr));
    // All runs are kept, so the same search ends at once, and the same.
    assert_eq!(tune(&small).stdout, found.stdout);
    let best = folder.join("best.toml");
    let (json, _) = super::program::run(QUICK, &["--seed", "1000", "--planner", best.to_str().unwrap()]);
    assert_eq!(json.outcome, "reached");
}
