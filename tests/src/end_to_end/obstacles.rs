//! What stands in the way and is on no map.

use std::path::{Path, PathBuf};

use super::program::{Deployment, curionav, quickstart, run, turn};

const CLOSED: &str = "scenarios/closed/closed-1-empty.toml";
const REOPENED: &str = "scenarios/reopened/reopened-1-empty.toml";
/// A box across the way in the foyer of the first scenario.
const BOX: &str = "\n[[world.objects]]\nat = [3.5, 4.1, 0.0]\nsize = [0.4, 2.0]\n";

/// The first scenario with the box, in `folder`.
pub(crate) fn foyer(folder: &Path) -> PathBuf {
    let path = folder.join("box.toml");
    std::fs::write(&path, quickstart() + BOX).unwrap();
    path
}

#[test]
fn a_box_is_gone_around() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let scenario = foyer(folder.path());
    for planner in ["curionav", "curiosity", "mppi", "dwa"] {
        for seed in ["1", "2"] {
            let (json, status) = run(scenario.to_str().unwrap(), &["--planner", planner, "--seed", seed]);
            assert_eq!((json.outcome.as_str(), status), ("reached", 0), "{planner}, seed {seed}: {json:?}");
        }
    }
}

#[test]
fn services_and_replays_know_of_the_same_obstacles() {
    let _turn = turn();
    let folder = tempfile::tempdir().unwrap();
    let scenario = foyer(folder.path());
    let scenario = scenario.to_str().unwrap();
    let recorded = folder.path().join("run.mcap");
    let recorded = recorded.to_str().unwrap();
    let expected = run(scenario, &["--record", recorded]).0;
    let plain = run("scenarios/quickstart.toml", &[]).0;
    assert_ne!(expected.decisions_sha256, plain.decisions_sha256);
    let deployment = Deployment::start(2);
    let (json, status) = run(scenario, &["--connect", deployment.endpoint()]);
    assert_eq!(json.decisions_sha256, expected.decisions_sha256, "{json:?}");
    assert_eq!((status, json.cycles.degraded), (0, 0));
    assert_eq!(deployment.stop(), 0);

    let replayed = curionav(&["replay", recorded, "--json"]);
    assert!(replayed.status.success(), "{replayed:?}");
    let said: serde_json::Value = serde_json::from_slice(&replayed.stdout).unwrap();
    assert_eq!((&said["differing"], &said["replayed"]), (&0.into(), &said["cycles"]), "{said}");

    let explained = curionav(&["explain", recorded, "--cycle", "10"]);
    let words = String::from_utf8(explained.stdout).unwrap();
    assert!(words.contains("things that are on no map"), "{words}");
}

#[test]
fn a_closed_way_ends_the_mission_with_its_reason_and_one_that_opens_again_is_taken() {
    let _turn = turn();
    for planner in ["curionav", "curiosity", "mppi", "dwa"] {
        let (json, status) = run(CLOSED, &["--planner", planner]);
        assert_eq!((json.outcome.as_str(), status), ("no_way", 1), "{planner}: {json:?}");
        assert!(json.metrics.time_s > 25.0, "{planner}: {json:?}");
        let (json, status) = run(REOPENED, &["--planner", planner]);
        assert_eq!((json.outcome.as_str(), status), ("reached", 0), "{planner}: {json:?}");
    }
}
