//! Runs in which people are known by the tracker alone.

use std::collections::BTreeSet;

use super::program::{Deployment, comes_true, in_real_time, is_alive, run, turn, wait_until_running};

const SCENARIO: &str = "scenarios/quickstart.toml";
/// With many people, so that an error of a few centimetres changes a decision.
const CROWDED: &str = "scenarios/paper/env4-s2.toml";
const TRACKED: [&str; 2] = ["--perception", "tracked"];

#[test]
fn people_are_tracked_alike_in_one_process_and_in_many() {
    let _turn = turn();
    let (embedded, status) = run(SCENARIO, &TRACKED);
    assert_eq!(
        (embedded.outcome.as_str(), status, embedded.cycles.degraded),
        ("reached", 0, 0),
        "{embedded:?}"
    );
    let deployment = Deployment::start(2);
    let (json, _) = run(SCENARIO, &[&TRACKED[..], &["--connect", deployment.endpoint()]].concat());
    assert_eq!(json.decisions_sha256, embedded.decisions_sha256, "{json:?}");
    // How people are known makes a difference; what the file says is what is chosen by its name.
    let of = |perception: &str| run(CROWDED, &["--perception", perception]).0.decisions_sha256;
    let ways = ["truth", "robot-frame", "tracked", "tracked-all-round"].map(of);
    assert_eq!(BTreeSet::from(ways.clone()).len(), ways.len(), "{ways:?}");
    assert_eq!(run(CROWDED, &[]).0.decisions_sha256, ways[0]);
}

#[test]
fn a_tracker_that_is_killed_in_real_time_comes_back_and_the_goal_is_reached() {
    let _turn = turn();
    in_real_time(|speed| {
        let deployment = Deployment::start(1);
        let endpoint = deployment.endpoint().to_owned();
        let running = std::thread::spawn(move || {
            let speed = speed.to_string();
            run(SCENARIO, &[&TRACKED[..], &["--connect", &endpoint, "--speed", &speed]].concat())
        });
        wait_until_running(deployment.endpoint());
        let killed = deployment.pid("tracker-0");
        deployment.kill("tracker-0");
        assert!(comes_true(|| !is_alive(killed)));
        assert!(!running.is_finished(), "the run was over before it was killed");
        let (json, status) = running.join().unwrap();
        assert_eq!((json.outcome.as_str(), status), ("reached", 0), "{json:?}");
        (json, true)
    });
}
