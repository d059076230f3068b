//! `curionav scale`: what it prints and what it leaves behind. How fast anything is, is not for tests.

use std::path::{Path, PathBuf};

use curionav_testing::skip;
use serde_json::Value;

use super::program::{LIMIT, comes_true, curionav, is_alive, real_time, signal, spawn, turn, wait};

const QUICK: [&str; 3] = ["--scenario", "scenarios/quickstart.toml", "--json"];

/// `curionav scale` with these arguments in a small scenario: its JSON, or what it says instead.
fn scale(arguments: &[&str]) -> Result<Value, (i32, String)> {
    let output = curionav(&[&["scale"], arguments, &QUICK].concat());
    let error = String::from_utf8(output.stderr).unwrap();
    match output.status.code().unwrap() {
        0 => Ok(serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{arguments:?}: {e}"))),
        code => Err((code, error)),
    }
}

fn measured(arguments: &[&str]) -> Value {
    scale(arguments).unwrap_or_else(|(code, error)| panic!("{arguments:?}: status {code}: {error}"))
}

fn rows(json: &Value) -> &Vec<Value> {
    json["rows"].as_array().unwrap()
}

fn positive(row: &Value, keys: &[&str]) {
    for key in keys {
        assert!(row[key].as_f64().is_some_and(|n| n > 0.0 && n.is_finite()), "{key} in {row}");
    }
}

/// Control groups of the measurement that process `pid` ran.
fn groups_of(pid: u32) -> Vec<PathBuf> {
    fn below(directory: &Path, depth: usize, name: &str, found: &mut Vec<PathBuf>) {
        for entry in std::fs::read_dir(directory).into_iter().flatten().flatten() {
            if entry.file_type().is_ok_and(|t| t.is_dir()) {
                if entry.file_name().to_string_lossy() == name {
                    found.push(entry.path());
                } else if depth > 0 {
                    below(&entry.path(), depth - 1, name, found);
                }
            }
        }
    }
    let mut found = Vec::new();
    below(Path::new("/sys/fs/cgroup"), 4, &format!("curionav-scale-{pid}"), &mut found);
    found
}

/// Processes that `pid` has started.
fn children_of(pid: u32) -> Vec<u32> {
    let parent = |child: u32| {
        let stat = std::fs::read_to_string(format!("/proc/{child}/stat")).ok()?;
        stat.rsplit(')').next()?.split_whitespace().nth(1)?.parse::<u32>().ok()
    };
    let processes = std::fs::read_dir("/proc").unwrap().flatten();
    let pids = processes.filter_map(|entry| entry.file_name().to_str()?.parse().ok());
    pids.filter(|child| parent(*child) == Some(pid)).collect()
}

#[test]
fn every_number_of_replicas_has_a_row() {
    let _turn = turn();
    // Enough for some answers on a machine as slow as this one.
    let seconds = (1.0 / real_time()).to_string();
    for (service, more) in
        [("cnc", &["--batch", "200", "--people", "9"][..]), ("cpc", &["--batch", "64"]), ("generator", &[])]
    {
        let arguments = [&["--service", service, "--replicas", "1,2", "--seconds", &seconds], more].concat();
        let json = measured(&arguments);
        assert_eq!(json["service"], service);
        assert_eq!(rows(&json).len(), 2, "{json}");
        for (row, replicas) in rows(&json).iter().zip([1, 2]) {
            assert_eq!(row["replicas"], replicas);
            positive(row, &["candidates_per_s", "p50_ms", "p99_ms", "efficiency"]);
            assert!(row["p99_ms"].as_f64() >= row["p50_ms"].as_f64(), "{row}");
        }
        assert_eq!(rows(&json)[0]["efficiency"], 1.0);
        if service == "cnc" {
            assert_eq!((&json["batch"], &json["people"]), (&Value::from(200), &Value::from(9.0)));
        }
    }
}

#[test]
fn it_says_when_asking_pays_how_many_robots_are_served_and_what_processes_cost() {
    let _turn = turn();
    let even = ["--break-even", "--replicas", "1", "--batch", "16,64", "--people", "3", "--seconds", "0.5"];
    let json = measured(&[&["--service", "cpc"], &even[..]].concat());
    assert_eq!((rows(&json).len(), json["break_even"].as_array().unwrap().len()), (2, 1), "{json}");
    for row in rows(&json) {
        positive(row, &["replicas", "people", "batch", "in_process_ms", "pool_ms"]);
    }

    let even =
        ["--service", "generator", "--break-even", "--replicas", "1", "--trees", "2,1", "--seconds", "0.5"];
    let json = measured(&even);
    let trees: Vec<&Value> = rows(&json).iter().map(|row| &row["trees"]).collect();
    assert_eq!(
        (trees, json["break_even"].as_array().unwrap().len()),
        (vec![&1.into(), &2.into()], 1),
        "{json}"
    );

    let json = measured(&["--service", "cnc", "--replicas", "1", "--robots", "1,3", "--seconds", "1"]);
    assert_eq!(rows(&json).len(), 2, "{json}");
    for row in rows(&json) {
        positive(row, &["robots", "p50_ms", "p99_ms", "budget_ms", "fairness"]);
        let shares = ["unanswered", "skipped", "fairness"].map(|key| row[key].as_f64().unwrap());
        assert!(shares.iter().all(|share| (0.0..=1.0 + 1e-9).contains(share)), "{row}");
    }

    let json = measured(&["--overhead", "--seconds", "0.5"]);
    positive(&json, &["cycles", "rounds", "bare_p50_ms"]);
    assert!(json["round_trips"].is_f64(), "{json}");
    let questions: Vec<&str> =
        json["questions"].as_array().unwrap().iter().map(|q| q["question"].as_str().unwrap()).collect();
    assert_eq!(questions, ["generator", "cnc", "cpc"]);
}

#[test]
fn a_fleet_plans_over_two_routers_and_comes_back_when_one_is_killed() {
    let _turn = turn();
    let place = tempfile::tempdir().unwrap();
    let pki = place.path().join("pki");
    for secure in [&[][..], &["--secure", pki.to_str().unwrap()]] {
        let fleet = ["--fleet", "3", "--replicas", "2", "--rate", "2", "--seconds", "2"];
        let json = measured(&[&fleet[..], secure].concat());
        assert_eq!((&json["routers"], &json["replicas"]), (&Value::from(2), &Value::from(2)));
        let [row] = &rows(&json)[..] else { panic!("{json}") };
        // An arbiter per robot, and two replicas of three roles.
        assert_eq!((&row["robots"], &row["tokens"]), (&Value::from(3), &Value::from(9)));
        positive(row, &["answered", "fairness", "questions", "sent_kb", "received_kb", "p50_ms", "ready_s"]);
        positive(row, &["routers_mib", "replicas_mib"]);
        // A robot of the first router has cycles without an answer, or none while it connects again.
        assert!(row["healed_s"].as_f64().is_some_and(f64::is_finite), "{row}");
        let shares = ["planned", "late", "answered", "trees_of_pool", "scores_of_pool", "fairness"];
        let is_share = |key: &&str| row[*key].as_f64().is_some_and(|share| (0.0..=1.1).contains(&share));
        assert!(shares.iter().all(is_share), "{row}");
    }
}

#[test]
fn a_drive_with_several_trees_has_a_row() {
    let _turn = turn();
    let json = measured(&["--service", "generator", "--trees", "2"]);
    let [row] = &rows(&json)[..] else { panic!("{json}") };
    for (key, count) in [("trees", 2), ("generators", 2), ("drives", 1)] {
        assert_eq!(row[key], count, "{key} in {row}");
    }
    positive(row, &["candidates", "p50_ms", "p99_ms"]);
    for key in ["cut_short", "grown_locally", "td"] {
        assert!(row[key].as_f64().is_some_and(|share| (0.0..=1.0).contains(&share)), "{key} in {row}");
    }
}

#[test]
fn quotas_are_kept_and_nothing_is_left_when_it_is_interrupted() {
    let _turn = turn();
    let quick = ["--service", "cpc", "--replicas", "2", "--cpu-quota", "0.1", "--batch", "64"];
    match scale(&[&quick[..], &["--seconds", "0.5"]].concat()) {
        Ok(json) => assert_eq!((&json["cpu_quota"], rows(&json).len()), (&Value::from(0.1), 1)),
        Err((code, error)) => {
            assert!(code == 2 && error.contains("control group"), "status {code}: {error}");
            skip(&format!("there are no control groups: {}", error.trim()));
            return;
        }
    }

    let mut child = spawn(&[&["scale"], &quick[..], &["--seconds", "600"], &QUICK].concat());
    let pid = child.id();
    let limited = || {
        let in_group = |group: &PathBuf| std::fs::read_to_string(group.join("replica-1/cgroup.procs"));
        groups_of(pid).iter().any(|group| in_group(group).is_ok_and(|procs| !procs.is_empty()))
    };
    assert!(comes_true(limited), "replicas were not put into groups");
    let children = children_of(pid);
    // A router and two replicas.
    assert_eq!(children.len(), 3, "{children:?}");
    signal("INT", pid);
    let status = wait(&mut child, LIMIT).expect("ended in time");
    assert_eq!(status.code(), Some(1));
    assert!(!children.iter().any(|child| is_alive(*child)), "processes outlived it");
    assert_eq!(groups_of(pid), Vec::<PathBuf>::new());
}

#[test]
fn what_makes_no_sense_is_refused_in_one_line() {
    for (arguments, names) in [
        (&["--replicas", "1"][..], "--service"),
        (&["--service", "driver"], "driver"),
        (&["--service", "cpc", "--replicas", "0"], "--replicas"),
        (&["--service", "cpc", "--cpu-quota", "0"], "--cpu-quota"),
        (&["--service", "cpc", "--batch", "5000"], "--batch"),
        (&["--service", "cpc", "--batch", "10,20"], "--batch"),
        (&["--service", "cnc", "--trees", "2"], "--trees"),
        (&["--service", "generator", "--trees", "9"], "--trees"),
        (&["--service", "generator", "--trees", "2", "--replicas", "1,2"], "--replicas"),
        (&["--service", "generator", "--drives", "2"], "--drives"),
        (&["--service", "generator", "--people", "3"], "--people"),
        (&["--service", "cpc", "--overhead"], "--overhead"),
        (&["--service", "cpc", "--fleet", "2"], "--fleet"),
        (&["--fleet", "2", "--replicas", "1,2"], "--replicas"),
        (&["--fleet", "2", "--rate", "11"], "--rate"),
        (&["--service", "cpc", "--light"], "--fleet"),
        (&["--service", "cpc", "--secure", "pki"], "--secure"),
        (&["--service", "cpc", "--planner", "unknown"], "unknown"),
    ] {
        let (code, error) = scale(arguments).expect_err("refused");
        assert!(code == 2 && error.contains(names), "{arguments:?}: status {code}: {error}");
    }
}
