//! Recordings: whole, killed, replayed, explained.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::OnceLock;

use curionav_planning::profile::Profile;
use curionav_runtime::convert;
use curionav_schemas::{
    Action, Belief, CycleReport, Degradation, Memory, Message, Mission, Particles, Reason,
};
use serde::Deserialize;

use super::program::{
    Deployment, LIMIT, RunJson, comes_true, curionav, program, real_time, root, run, signal, spawn, turn,
    wait, wait_until_running,
};

const QUICK: &str = "scenarios/quickstart.toml";
const SEED: &str = "1000";

/// What `curionav replay --json` says, as people script against it.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct ReplayJson {
    recording: PathBuf,
    planner: String,
    recorded_planner: String,
    version: String,
    cycles: u64,
    replayed: u64,
    differing: u64,
    degraded: u64,
    skipped: BTreeMap<String, u64>,
    cut_short: bool,
    differences: Vec<DifferenceJson>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct DifferenceJson {
    robot: String,
    epoch: u64,
    seq: u64,
    time_s: f64,
    recorded: SideJson,
    replayed: SideJson,
    apart_m: Option<f64>,
    degraded: Vec<Degradation>,
}

#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct SideJson {
    action: Action,
    candidate: Option<u32>,
    reason: Reason,
}

fn replay(path: &Path, more: &[&str]) -> (ReplayJson, i32) {
    let arguments = [&["replay", path.to_str().unwrap(), "--json"], more].concat();
    let output = curionav(&arguments);
    let json = serde_json::from_slice(&output.stdout)
        .unwrap_or_else(|e| panic!("{arguments:?}: {e}\n{}", String::from_utf8_lossy(&output.stderr)));
    (json, output.status.code().unwrap())
}

/// A recorded run in one process, made once.
fn recording() -> &'static (tempfile::TempDir, PathBuf, RunJson) {
    static MADE: OnceLock<(tempfile::TempDir, PathBuf, RunJson)> = OnceLock::new();
    MADE.get_or_init(|| {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("run.mcap");
        let (json, status) = run(QUICK, &["--seed", SEED, "--record", path.to_str().unwrap()]);
        assert_eq!(status, 0, "{json:?}");
        (folder, path, json)
    })
}

/// All messages of one kind, as another reader of the format sees them.
fn messages<M: Message>(path: &Path) -> Vec<M> {
    let bytes = std::fs::read(path).unwrap();
    let stream = mcap::MessageStream::new(&bytes).unwrap();
    let found = stream.filter_map(|message| {
        let message = message.unwrap();
        let schema = message.channel.schema.clone().unwrap();
        (schema.name == M::SCHEMA).then(|| {
            assert_eq!(
                (message.channel.message_encoding.as_str(), schema.encoding.as_str()),
                ("cbor", "cddl")
            );
            assert!(std::str::from_utf8(&schema.data).unwrap().contains(&format!("{} = ", M::NAME)));
            M::decode(&message.data, None).unwrap()
        })
    });
    found.collect()
}

#[test]
fn recording_changes_no_decision_and_holds_every_cycle() {
    let _turn = turn();
    let (_, path, recorded) = recording();
    assert_eq!(recorded.decisions_sha256, run(QUICK, &["--seed", SEED]).0.decisions_sha256);
    // A cycle that ends in a stop before planning has no report; in this run there is none.
    assert_eq!(messages::<CycleReport>(path).len() as u64, recorded.cycles.count);
    assert_eq!(messages::<Memory>(path).len() as u64, recorded.cycles.count);

    let bytes = std::fs::read(path).unwrap();
    let summary = mcap::Summary::read(&bytes).unwrap().expect("complete");
    let schemas: BTreeMap<&str, &str> = (summary.channels.values())
        .map(|channel| (channel.topic.as_str(), channel.schema.as_ref().unwrap().name.as_str()))
        .collect();
    for (topic, schema) in [
        ("curionav/@v1/robot/robot/scan", "curionav.scan.v1"),
        ("curionav/@v1/robot/robot/decision", "curionav.decision.v1"),
        ("curionav/@v1/world/world/run", "curionav.run_status.v1"),
        ("curionav/@v1/status/arbiter/arbiter", "curionav.service_status.v1"),
        ("/map", "foxglove.Grid"),
        ("/tf", "foxglove.FrameTransform"),
        ("/robot/scan", "foxglove.LaserScan"),
        ("/robot/belief", "foxglove.PoseInFrame"),
        ("curionav/@v1/robot/robot/particles", "curionav.particles.v1"),
        ("/robot/particles", "foxglove.PosesInFrame"),
        ("/robot/path", "foxglove.PosesInFrame"),
        ("/robot/people", "foxglove.SceneUpdate"),
        ("/robot/candidates", "foxglove.SceneUpdate"),
        ("/robot/log", "foxglove.Log"),
    ] {
        assert_eq!(schemas.get(topic), Some(&schema), "{topic}: {schemas:?}");
    }
    // It plays at the robot's pace, however fast it was simulated and however long it was prepared for.
    let times = mcap::MessageStream::new(&bytes).unwrap().map(|message| message.unwrap());
    let scans = times.filter(|message| message.channel.topic.ends_with("/robot/scan"));
    let times: Vec<u64> = scans.map(|message| message.log_time).collect();
    let seconds = (times.iter().max().unwrap() - times.iter().min().unwrap()) as f64 * 1e-9;
    assert!((seconds - recorded.metrics.time_s).abs() < 0.3, "{seconds} s of {:?}", recorded.metrics);
}

#[test]
fn particles_are_recorded_twice_a_second_and_are_what_the_belief_is_made_of() {
    let _turn = turn();
    let (_, path, recorded) = recording();
    let beliefs: BTreeMap<u64, Belief> =
        messages::<Belief>(path).into_iter().map(|belief| (belief.tick, belief)).collect();
    let found = messages::<Particles>(path);
    assert!((found.len() as f64 / (2.0 * recorded.metrics.time_s) - 1.0).abs() < 0.1, "{}", found.len());
    for particles in found {
        let belief = &beliefs[&particles.tick];
        assert_eq!((particles.stamp, particles.x.len()), (belief.stamp, belief.health.particles as usize));
        let weight: f64 = particles.weight.iter().map(|w| f64::from(*w)).sum();
        assert!((weight - 1.0).abs() < 1e-3, "tick {}: {weight}", particles.tick);
        // Where nothing is outside the one cluster, its mean is the belief's.
        if belief.health.outside_weight < 1e-6 {
            let mean = |of: &[f32]| -> f64 {
                of.iter().zip(particles.weight.iter()).map(|(v, w)| f64::from(*v) * f64::from(*w)).sum()
            };
            let (x, y) = (mean(&particles.x) - belief.x, mean(&particles.y) - belief.y);
            assert!(x.hypot(y) < 0.1, "tick {}: {x} m, {y} m beside the belief", particles.tick);
        }
    }
}

#[test]
fn the_same_planner_decides_the_same_again_and_another_does_not() {
    let _turn = turn();
    let (_, path, recorded) = recording();
    let (same, status) = replay(path, &[]);
    assert_eq!((same.differing, status), (0, 0), "{same:?}");
    assert_eq!((same.cycles, same.replayed), (recorded.cycles.count, recorded.cycles.count));
    assert!(same.skipped.is_empty() && !same.cut_short);
    assert_eq!((&same.recording, same.version.as_str()), (path, env!("CARGO_PKG_VERSION")));
    assert_eq!((&same.planner, same.degraded), (&same.recorded_planner, 0));
    let reports = messages::<CycleReport>(path);
    // The last has another generator, which grows trees of its own.
    for planner in ["distance-only", "risk-rrt"] {
        let (other, status) = replay(path, &["--planner", planner]);
        assert_eq!((other.planner.as_str(), other.replayed, status), (planner, same.replayed, 1));
        assert!(other.differing > 0, "{other:?}");
        assert_eq!(other.differing, other.differences.len() as u64);
        for found in &other.differences {
            let report = reports.iter().find(|r| (r.epoch, r.seq) == (found.epoch, found.seq)).unwrap();
            assert_eq!(found.robot, report.robot);
            assert!((found.time_s - report.scene.stamp).abs() < 1e-9);
            let decision = &report.decision;
            let recorded = (decision.action, decision.candidate, decision.reason.clone());
            let SideJson { action, candidate, reason } = &found.recorded;
            assert_eq!((*action, *candidate, reason.clone()), recorded);
            let is_stopped = [found.recorded.action, found.replayed.action].contains(&Action::Stop);
            assert_eq!(found.apart_m.is_none(), is_stopped, "{found:?}");
        }
    }
}

#[test]
fn what_another_weight_is_said_to_lead_to_it_leads_to() {
    let _turn = turn();
    let (folder, path, _) = recording();
    let mission = messages::<Mission>(path).pop().unwrap();
    let reports = messages::<CycleReport>(path);
    let mut changed = 0;
    for (term, factor) in [("cnc", 2.0), ("distance", 0.5)] {
        let mut profile: Profile = convert::from_value("profile", &mission.order.profile).unwrap();
        profile.terms.get_mut(term).unwrap().weight *= factor;
        let file = folder.path().join(format!("{term}.toml"));
        std::fs::write(&file, toml::to_string(&profile).unwrap()).unwrap();
        let (replayed, _) = replay(path, &["--planner", file.to_str().unwrap()]);
        for report in &reports {
            let Some(chosen) = report.chosen else { continue };
            let scored = report.terms.iter().find(|scored| scored.term == term).unwrap();
            let said = if factor > 1.0 { scored.doubled } else { scored.halved };
            let found = replayed.differences.iter().find(|difference| difference.seq == report.seq);
            let taken = found.map_or(report.decision.candidate, |difference| difference.replayed.candidate);
            assert_eq!(
                said.map(|index| report.candidates.id[index as usize]),
                taken,
                "{term} {}",
                report.seq
            );
            changed += u32::from(said != Some(chosen));
        }
    }
    assert!(changed > 0, "no weight would have changed anything: this run shows nothing");
}

#[test]
fn a_cycle_is_explained_in_words() {
    let _turn = turn();
    let (_, path, _) = recording();
    let recording = path.to_str().unwrap();
    let report = messages::<CycleReport>(path).into_iter().find(|report| report.runner_up.is_some()).unwrap();
    let cycle = report.seq.to_string();
    let explain = |more: &[&str]| curionav(&[&["explain", recording], more].concat());
    let output = explain(&["--cycle", &cycle]);
    let text = String::from_utf8(output.stdout).unwrap();
    let chosen = report.decision.candidate.unwrap();
    for part in
        [&format!("cycle {cycle}"), &format!("follow candidate {chosen}"), "would have been next", "cnc raw"]
    {
        assert!(text.contains(part), "lacks `{part}`: {text}");
    }
    let none = explain(&["--cycle", "999999"]);
    let error = String::from_utf8(none.stderr).unwrap();
    assert!(none.status.code() == Some(1) && error.contains("no such cycle; it has cycles 1 to"), "{error}");
}

#[test]
fn a_recording_of_another_version_is_refused_with_words() {
    let _turn = turn();
    let (folder, path, _) = recording();
    let older = folder.path().join("older.mcap");
    let bytes = std::fs::read(path).unwrap();
    let mut writer = mcap::Writer::new(std::fs::File::create_new(&older).unwrap()).unwrap();
    for message in mcap::MessageStream::new(&bytes).unwrap() {
        let mut message = message.unwrap();
        if message.channel.schema.as_ref().is_some_and(|schema| schema.name == Memory::SCHEMA) {
            let memory = Memory::decode(&message.data, None).unwrap();
            message.data = Memory { version: "0.0.9".into(), ..memory }.encode().into();
        }
        writer.write(&message).unwrap();
    }
    writer.finish().unwrap();
    let output = curionav(&["replay", older.to_str().unwrap()]);
    let error = String::from_utf8(output.stderr).unwrap();
    assert_eq!(output.status.code(), Some(2), "{error}");
    assert!(error.contains("arbiter of version 0.0.9") && error.lines().count() == 1, "{error}");
    assert_eq!(replay(&older, &["--any-version"]).1, 0);

    let nothing = curionav(&["replay", "scenarios/quickstart.toml"]);
    let error = String::from_utf8(nothing.stderr).unwrap();
    assert!(nothing.status.code() == Some(2) && error.contains("not an MCAP file"), "{error}");
}

#[test]
fn a_recording_that_fails_hides_no_result() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("full.mcap");
    // A disk that is full after some kilobytes: writing beyond is an error, and no signal.
    let limited = "trap '' XFSZ; ulimit -f 64; exec \"$@\"";
    let run = ["run", QUICK, "--seed", SEED, "--json", "--record", path.to_str().unwrap()];
    let output = Command::new("sh")
        .args(["-c", limited, "sh", program().to_str().unwrap()])
        .args(run)
        .current_dir(root())
        .env_remove("RUST_LOG")
        .output()
        .unwrap();
    let error = String::from_utf8(output.stderr).unwrap();
    let json: RunJson = serde_json::from_slice(&output.stdout).unwrap_or_else(|e| panic!("{e}: {error}"));
    assert_eq!((json.outcome.as_str(), output.status.code()), ("reached", Some(1)), "{error}");
    assert!(error.lines().last().unwrap().contains("full.mcap"), "{error}");
}

/// A recorder beside a deployment in which a run has begun, both ended when dropped.
struct Recorded {
    recorder: Child,
    run: Child,
    _deployment: Deployment,
}

impl Recorded {
    fn start(path: &Path) -> Self {
        let speed = real_time().to_string();
        let deployment = Deployment::start(1);
        let endpoint = deployment.endpoint().to_owned();
        let recorder = spawn(&["record", path.to_str().unwrap(), "--connect", &endpoint]);
        assert!(comes_true(|| path.exists()), "no recording was begun");
        let run = spawn(&["run", QUICK, "--seed", SEED, "--connect", &endpoint, "--speed", &speed]);
        let started = Self { recorder, run, _deployment: deployment };
        wait_until_running(&endpoint);
        // Some cycles are on disk.
        let grown = || std::fs::metadata(path).is_ok_and(|data| data.len() > 500_000);
        assert!(comes_true(grown), "nothing is written");
        started
    }
}

impl Drop for Recorded {
    fn drop(&mut self) {
        for child in [&mut self.recorder, &mut self.run] {
            if child.try_wait().unwrap().is_none() {
                child.kill().unwrap();
                child.wait().unwrap();
            }
        }
    }
}

#[test]
fn a_recorder_that_is_killed_leaves_what_it_has_heard() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("killed.mcap");
    let mut recorded = Recorded::start(&path);
    recorded.recorder.kill().unwrap();
    recorded.recorder.wait().unwrap();
    let (json, _) = replay(&path, &[]);
    assert!(json.cut_short && json.replayed > 0, "{json:?}");
    // In real time a busy machine may cut a cycle short; then, and only then, is it decided otherwise.
    assert!(json.differences.iter().all(|found| !found.degraded.is_empty()), "{json:?}");
    let explained = curionav(&["explain", path.to_str().unwrap()]);
    assert!(explained.status.success());

    let whole = folder.path().join("whole.mcap");
    let (killed, made) = (path.to_str().unwrap(), whole.to_str().unwrap());
    let recovered = curionav(&["record", made, "--recover", killed]);
    let said = String::from_utf8(recovered.stderr).unwrap();
    assert!(
        recovered.status.code() == Some(1) && said.trim_end().ends_with("; its end is missing"),
        "{said}"
    );
    assert!(mcap::Summary::read(&std::fs::read(&whole).unwrap()).unwrap().is_some());
    let (again, _) = replay(&whole, &[]);
    assert_eq!((again.cut_short, again.replayed), (false, json.replayed));
}

#[test]
fn an_interrupted_recorder_completes_its_file_and_a_file_is_never_overwritten() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("interrupted.mcap");
    let mut recorded = Recorded::start(&path);
    signal("INT", recorded.recorder.id());
    let status = wait(&mut recorded.recorder, LIMIT).expect("ended in time");
    assert_eq!(status.code(), Some(0));
    let summary = mcap::Summary::read(&std::fs::read(&path).unwrap()).unwrap();
    assert!(summary.is_some_and(|summary| !summary.chunk_indexes.is_empty()));
    assert!(!replay(&path, &[]).0.cut_short);

    let again = curionav(&["run", QUICK, "--record", path.to_str().unwrap()]);
    let error = String::from_utf8(again.stderr).unwrap();
    assert!(again.status.code() == Some(2) && error.contains("interrupted.mcap"), "{error}");
}

#[test]
fn a_robot_that_drives_is_explained_as_it_goes() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let recorded = Recorded::start(&folder.path().join("live.mcap"));
    let endpoint = recorded._deployment.endpoint();
    let output = curionav(&["explain", "--robot", "robot", "--connect", endpoint]);
    let text = String::from_utf8(output.stdout).unwrap();
    assert!(text.starts_with("Robot robot, cycle "), "{text}");
}
