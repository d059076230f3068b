//! What services make of missions: new goals, maps that are not there yet, pools that never come.

use std::time::{Duration, Instant};

use curionav_runtime::lockstep::{LOCKSTEP_PATIENCE, Latest};
use curionav_runtime::process::Service;
use curionav_runtime::topic::Flow;
use curionav_schemas::{
    Clock, MissionCommand, MissionEnd, MissionState, Odometry, Prepared, Refusal, Reject, ServiceStatus,
    Twist, Value,
};
use curionav_testing::golden;

use super::test_bench::TestBench;
use crate::faults::corridor_map::START;

const DRIVER: Service = curionav_driver::run;
const ARBITER: Service = curionav_arbiter::run;
const GENERATOR: Service = curionav_trajectory_generator::run;
const LOCALIZER: Service = curionav_localizer::run;

fn waits_for_a_map(status: &ServiceStatus) -> bool {
    let of_a_map = |reject: &Reject| matches!(reject.why, Refusal::NoMap { .. });
    matches!(&status.prepared[..], [Prepared::Waiting { revision: 1, reject }] if of_a_map(reject))
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn every_role_gets_ready_for_a_new_goal_in_mid_run() {
    let mut bench = TestBench::start(&[DRIVER, GENERATOR, ARBITER, LOCALIZER], true).await;
    bench.host_map();
    let begun = bench.set_mission(&["arbiter", "driver", "localizer"]).await;
    bench.runs().await;
    for goal in [10.0, 20.0] {
        let given =
            bench.request(MissionCommand::Goal { x: goal, y: START.y, heading: None, way: None }).await;
        assert_eq!((given.run, given.state), (begun.run, MissionState::Preparing));
        let mission = bench.runs().await;
        assert_eq!((mission.revision, mission.order.goal_x), (given.revision, goal));
        assert_eq!(mission.ready, ["arbiter", "driver", "localizer"]);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_mission_waits_for_a_map_that_is_not_served_yet() {
    for (role, service) in [("arbiter", ARBITER), ("localizer", LOCALIZER)] {
        let mut bench = TestBench::start(&[DRIVER, GENERATOR, service], true).await;
        bench.set_mission(&[role]).await;
        bench.status_that(role, waits_for_a_map).await;
        let mission = bench.mission_that(|_| true).await;
        assert_eq!((mission.state, mission.end), (MissionState::Preparing, None), "{role}");
        bench.host_map();
        bench.runs().await;
        bench.status_that(role, |s| s.prepared == [Prepared::Revision { revision: 1 }]).await;
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn an_arbiter_that_waits_hears_of_other_missions() {
    // It must not generate itself, and there is no generator: it waits for as long as there is nothing better to do.
    let mut bench = TestBench::start(&[DRIVER, ARBITER], false).await;
    bench.host_map();
    bench.set_mission(&["arbiter"]).await;
    // Outside the corridor.
    bench.request(MissionCommand::Goal { x: 100.0, y: START.y, heading: None, way: None }).await;
    let refused = bench.mission_that(|mission| mission.state == MissionState::Finished).await;
    let unreachable = |reject: &Reject| matches!(reject.why, Refusal::UnreachableGoal { x: 100.0, .. });
    assert_eq!(refused.revision, 2);
    assert!(
        matches!(&refused.end, Some(MissionEnd::Unprepared { role, reject, .. }) if role == "arbiter" && unreachable(reject)),
        "{:?}",
        refused.end
    );
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn wrong_parameters_of_the_tracker_are_refused_by_every_role_that_uses_them() {
    for (role, service) in [("arbiter", ARBITER), ("localizer", LOCALIZER)] {
        let mut bench = TestBench::start(&[DRIVER, service], true).await;
        bench.host_map();
        let mut order = TestBench::order(Clock::Realtime, &[role]);
        order.tracker = Some(Value::Map(vec![("map_sigma".into(), (-1.0).into())]));
        bench.request(MissionCommand::Set { order: Box::new(order) }).await;
        let refused = bench.mission_that(|mission| mission.state == MissionState::Finished).await;
        let Some(MissionEnd::Unprepared { role: by, reject, .. }) = refused.end else {
            panic!("{refused:?}")
        };
        assert_eq!((by.as_str(), reject.field.as_deref()), (role, Some("tracker.map_sigma")), "{reject}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn services_that_wait_end_when_they_are_asked_to() {
    let mut bench = TestBench::start(&[DRIVER, ARBITER], false).await;
    bench.host_map();
    bench.set_mission(&["arbiter"]).await;
    let looks_for_generators = |s: &curionav_schemas::ServiceStatus| {
        s.metrics.keys().any(|name| name.contains("pool_ready") && name.contains("generator"))
    };
    bench.status_that("arbiter", looks_for_generators).await;
    assert!(bench.end().await, "it goes on waiting for a generator");

    // For a map that is not served.
    let bench = TestBench::start(&[DRIVER, LOCALIZER], true).await;
    bench.set_mission(&["localizer"]).await;
    bench.status_that("localizer", waits_for_a_map).await;
    assert!(bench.end().await, "it goes on waiting for a map");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_service_that_waits_for_a_tick_hears_of_another_run_and_of_the_end() {
    let mut bench = TestBench::start(&[DRIVER, LOCALIZER], true).await;
    bench.host_map();
    let odometry = bench.topic::<Odometry>("odom", Flow::Sensor);
    let awaits_a_scan = async || {
        bench.set_mission_in(Clock::Lockstep, &["localizer"]).await;
        let begun = Instant::now();
        bench.runs().await;
        // The scan of this tick never comes.
        odometry.publish(&Odometry { tick: 0, stamp: 0.0, ..golden::odometry() }, Clock::Lockstep);
        tokio::time::sleep(Duration::from_millis(200)).await;
        begun.elapsed()
    };
    awaits_a_scan().await;
    let took = awaits_a_scan().await;
    assert!(took < LOCKSTEP_PATIENCE / 2, "the next run began after {took:?}");
    assert!(bench.end().await, "it goes on waiting for a scan");
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_standby_arbiter_that_lags_in_lockstep_does_not_wait_for_what_has_passed() {
    let bench = TestBench::start(&[], true).await;
    let commands = bench.topic::<Twist>("cmd", Flow::Control);
    let mut heard = Latest::new(bench.inbox::<Twist>("cmd"));
    commands.publish(&Twist { tick: 5, ..golden::twist() }, Clock::Lockstep);
    assert!(heard.of_tick(5, Clock::Lockstep).await.is_some());
    let begun = Instant::now();
    assert!(heard.of_tick(2, Clock::Lockstep).await.is_none());
    assert!(begun.elapsed() < LOCKSTEP_PATIENCE / 2, "it waited for {:?}", begun.elapsed());
}
