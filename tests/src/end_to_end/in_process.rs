//! What the services in lockstep decide is what one thread without a network decides, bit for bit.

use curionav_deployment::embedded::Embedded;
use curionav_deployment::follow::follow;
use curionav_deployment::package::{self, Choice, Package, Perception};
use curionav_in_process::{play, prepare};
use curionav_planning::profile::Profile;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::fields::Fields;
use curionav_schemas::{Clock, Cycles, Outcome, RunResult};

use super::program::root;

const QUICKSTART: &str = "scenarios/quickstart.toml";

/// A scenario, and what differs from it.
type Case = (&'static str, Choice);

fn case(scenario: &'static str) -> Case {
    (scenario, Choice::default())
}

fn with_planner(scenario: &'static str, planner: &str) -> Case {
    (scenario, Choice { planner: Some(planner.to_owned()), ..Choice::default() })
}

fn read((scenario, choice): &Case) -> Package {
    package::read(&root().join(scenario), choice, Clock::Lockstep, 1.0).unwrap()
}

/// What does not depend on how fast the machine is.
fn timeless(result: RunResult) -> RunResult {
    let cycles = Cycles { p50_ms: 0.0, p99_ms: 0.0, max_ms: 0.0, ..result.cycles };
    RunResult { cycles, real_time_factor: 0.0, ..result }
}

/// Plays each case in this thread and by embedded services, compares all of the results, and gives them.
async fn alike(cases: &[Case]) -> Vec<RunResult> {
    let config = ServiceConfig { takes_turns: true, ..ServiceConfig::default() };
    let embedded = Embedded::start(&config).await.unwrap();
    let fields = Fields::of_maps([]);
    let mut results = Vec::new();
    for case in cases {
        let package = read(case);
        let by_services = follow(&embedded.session, &config, &package, false).await.unwrap().result;
        let prepared = prepare(&package.request, "robot", &fields).unwrap();
        let here = play(prepared, &fields).unwrap();
        let hashes = [&here, &by_services].map(|result| result.decisions_sha256.clone());
        assert_eq!(hashes[0], hashes[1], "{case:?}");
        let here = timeless(here);
        assert!(here == timeless(by_services), "{case:?}: same decisions, another result");
        results.push(here);
    }
    embedded.stop().await;
    results
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_suite_is_decided_alike() {
    let seventh = (QUICKSTART, Choice { seed: Some(7), ..Choice::default() });
    let suites = [
        "scenarios/paper/env1-s2.toml",
        "scenarios/rooms/corridors-1.toml",
        "scenarios/changed/offices-1.toml",
        "scenarios/dense/door-force-02.toml",
    ];
    let results = alike(&[&[case(QUICKSTART), seventh][..], &suites.map(case)].concat()).await;
    assert_ne!(results[0].decisions_sha256, results[1].decisions_sha256);
    assert!(results.iter().all(|result| result.cycles.count > 10 && result.cycles.degraded == 0));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn people_are_known_alike() {
    let known = |perception| (QUICKSTART, Choice { perception: Some(perception), ..Choice::default() });
    let results = alike(&[Perception::Tracked, Perception::RobotFrame].map(known)).await;
    assert_ne!(results[0].decisions_sha256, results[1].decisions_sha256);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_planner_decides_alike() {
    let cases: Vec<Case> = Profile::names().map(|planner| with_planner(QUICKSTART, planner)).collect();
    let results = alike(&cases).await;
    assert!(results.iter().zip(Profile::names()).all(|(result, planner)| result.planner == planner));
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_way_that_is_closed_is_given_up_alike() {
    let cases = ["scenarios/closed/closed-1-empty.toml", "scenarios/reopened/reopened-1-empty.toml"]
        .map(|scenario| with_planner(scenario, "curionav"));
    let outcomes: Vec<Outcome> = alike(&cases).await.iter().map(|result| result.outcome).collect();
    assert_eq!(outcomes, [Outcome::NoWay, Outcome::Reached]);
}
