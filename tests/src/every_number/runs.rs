//! Running what was accepted.

use std::collections::BTreeMap;
use std::path::PathBuf;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};

use toml::Value;

use super::cells::Cell;
use super::room::Room;
use crate::end_to_end::program::{LIMIT, program, wait};

/// Longest a run may take. On a quiet machine most take a few tenths of a second.
const RUN_LIMIT: Duration = Duration::from_secs(10);
/// On a slow or busy machine a run may take this many times as long as half of them do.
const MEDIANS: f64 = 30.0;
/// Most memory a process may take, KiB.
const MEMORY_LIMIT: u64 = 1 << 20;

/// A scenario in which one number is changed.
pub(super) struct Run {
    planner: &'static str,
    /// Which number, and to what.
    what: String,
    scenario: toml::Table,
}

impl Run {
    pub(super) fn new(planner: &'static str, cell: &Cell, scenario: toml::Table) -> Self {
        Self { planner, what: format!("{} = {:e}", cell.path, cell.value), scenario }
    }

    /// A number of `table`, which a scenario holds whole.
    pub(super) fn within(table: &str, planner: &'static str, cell: &Cell, base: &toml::Table) -> Self {
        let mut scenario = base.clone();
        scenario.insert(table.into(), Value::Table(cell.document.clone()));
        let run = Self::new(planner, cell, scenario);
        Self { what: format!("{planner}: {table}.{}", run.what), ..run }
    }

    /// Writes it into the room under a name of its own.
    fn write(&self, room: &Room, index: usize) -> PathBuf {
        let folder = room.path().join(self.planner);
        std::fs::create_dir_all(&folder).unwrap();
        let mut scenario = self.scenario.clone();
        scenario["map"]["file"] = "../room.yaml".into();
        for mask in ["keepout", "speed"] {
            scenario["map"][mask] = "../unmarked.yaml".into();
        }
        scenario["world"]["file"] = "../room.yaml".into();
        scenario["recorded"][0]["file"] = "../people.txt".into();
        scenario["name"] = format!("n{index}").into();
        let path = folder.join(format!("n{index}.toml"));
        std::fs::write(&path, toml::to_string(&scenario).unwrap()).unwrap();
        path
    }
}

/// All runs by workers that each do many, as a benchmark does.
pub(super) fn with_workers(room: &Room, runs: &[Run]) {
    let mut by_planner: BTreeMap<&str, usize> = BTreeMap::new();
    for (index, run) in runs.iter().enumerate() {
        run.write(room, index);
        *by_planner.entry(run.planner).or_default() += 1;
    }
    for (planner, count) in by_planner {
        let out = room.path().join(format!("out-{planner}"));
        let scenarios = room.path().join(planner).join("*.toml");
        let mut bench = start(&[
            "bench",
            "--planners",
            planner,
            "--scenarios",
            scenarios.to_str().unwrap(),
            "--repeats",
            "1",
            "--out",
            out.to_str().unwrap(),
        ]);
        let (ended, peak) = watch(&mut bench, LIMIT.max(RUN_LIMIT * count as u32));
        let rows = std::fs::read_to_string(out.join("journal.jsonl")).unwrap();
        let rows: Vec<serde_json::Value> =
            rows.lines().filter_map(|l| serde_json::from_str(l).ok()).collect();
        let seconds = |row: &serde_json::Value| Some((row["wall_s"].as_f64()?, index_of(row)));
        let mut took: Vec<(f64, usize)> = rows.iter().filter_map(seconds).collect();
        took.sort_by(|a, b| a.0.total_cmp(&b.0));
        let median = took.get(took.len() / 2).map_or(0.0, |(seconds, _)| *seconds);
        if let Some((seconds, index)) = took.last() {
            let what = &runs[*index].what;
            println!(
                "{planner}: {count} runs, median {median:.2} s, slowest {seconds:.1} s ({what}), {peak} KiB"
            );
            assert!(*seconds < RUN_LIMIT.as_secs_f64().max(MEDIANS * median), "{what} took {seconds} s");
        }
        let done = |index: usize| rows.iter().any(|row| row["scenario"] == format!("n{index}"));
        let missing: Vec<&str> = (runs.iter().enumerate())
            .filter(|(index, run)| run.planner == planner && !done(*index))
            .map(|(_, run)| run.what.as_str())
            .collect();
        assert!(ended.is_some() && missing.is_empty(), "{planner}: no end of {missing:?}");
        assert!(peak < MEMORY_LIMIT, "{planner}: a worker took {peak} KiB");
    }
}

/// The run of a row of the journal.
fn index_of(row: &serde_json::Value) -> usize {
    row["scenario"].as_str().unwrap()[1..].parse().unwrap()
}

/// Every run in a process of its own, on a machine without other work.
pub(super) fn one_by_one(room: &Room, runs: &[Run]) {
    let (mut slowest, mut largest) = ((Duration::ZERO, ""), (0, ""));
    let mut faults = Vec::new();
    for (index, run) in runs.iter().enumerate() {
        let path = run.write(room, index);
        let begin = Instant::now();
        let mut child = start(&["run", path.to_str().unwrap(), "--planner", run.planner, "--json"]);
        let (ended, peak) = watch(&mut child, RUN_LIMIT);
        let took = begin.elapsed();
        let status = ended.and_then(|s| s.code());
        println!("{:?} {:.2} s {peak} KiB: {}", status, took.as_secs_f64(), run.what);
        slowest = slowest.max((took, &run.what));
        largest = largest.max((peak, &run.what));
        // 0: reached, 1: collision or timeout, 2: refused. 3 or a signal is a fault.
        if !matches!(status, Some(0..=2)) || peak >= MEMORY_LIMIT {
            faults.push(&run.what);
        }
    }
    println!("{} runs; slowest {slowest:?}; largest {largest:?} KiB", runs.len());
    assert!(faults.is_empty(), "{faults:?}");
}

fn start(arguments: &[&str]) -> Child {
    Command::new(program())
        .args(arguments)
        .args(["--log", "off"])
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .unwrap()
}

/// Waits for the end of a process; also says what the largest of it and its children took, KiB.
fn watch(child: &mut Child, limit: Duration) -> (Option<std::process::ExitStatus>, u64) {
    let deadline = Instant::now() + limit;
    let mut peak = 0;
    loop {
        peak = peak.max(memory(child.id()));
        if let Some(status) = wait_a_moment(child) {
            return (Some(status), peak);
        }
        if Instant::now() > deadline {
            return (wait(child, Duration::ZERO), peak);
        }
    }
}

fn wait_a_moment(child: &mut Child) -> Option<std::process::ExitStatus> {
    let status = child.try_wait().unwrap();
    if status.is_none() {
        std::thread::sleep(Duration::from_millis(10));
    }
    status
}

/// Most resident memory of a process or one of its children so far, KiB.
fn memory(pid: u32) -> u64 {
    let status = std::fs::read_to_string(format!("/proc/{pid}/status")).unwrap_or_default();
    let own = status.lines().find_map(|l| l.strip_prefix("VmHWM:")?.split_whitespace().next()?.parse().ok());
    children(pid).into_iter().map(memory).chain(own).max().unwrap_or(0)
}

/// Processes started by any thread of a process.
pub(crate) fn children(pid: u32) -> Vec<u32> {
    let threads = std::fs::read_dir(format!("/proc/{pid}/task")).into_iter().flatten().flatten();
    let of_thread = |t: std::fs::DirEntry| std::fs::read_to_string(t.path().join("children")).ok();
    let all: Vec<String> = threads.filter_map(of_thread).collect();
    all.iter().flat_map(|list| list.split_whitespace()).filter_map(|pid| pid.parse().ok()).collect()
}
