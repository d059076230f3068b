//! A clock that begins anew: another run, or a base that was restarted in mid-run.

use curionav_planning::geometry::Pose2;
use curionav_schemas::{CommandReason, CycleReport, MissionState, Reason};

use super::base::Base;
use super::test_bench::TestBench;
use crate::faults::corridor_map::START;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_decision_of_the_run_before_is_not_followed_when_its_stamp_comes_again() {
    let bench = TestBench::start(&[curionav_driver::run], true).await;
    let base = Base::of(&bench);
    bench.set_mission(&["driver"]).await;
    bench.runs().await;
    for tick in 0..=20 {
        let command = base.command(tick, Some((1, 1 + tick))).await;
        assert_eq!(command.reason, CommandReason::Tracking, "tick {tick}");
    }
    let next = bench.set_mission(&["driver"]).await;
    bench.mission_that(|m| m.run == next.run && m.ready == ["driver"]).await;
    // The last one was made at tick 20 and would be valid for twelve more.
    for tick in 0..=25 {
        let command = base.command(tick, None).await;
        assert!(!command.reason.follows(), "tick {tick}: {:?}", command.reason);
        // But it still is the newest.
        assert_eq!((command.epoch, command.seq), (1, 21));
    }
    assert_eq!(base.command(26, Some((1, 22))).await.reason, CommandReason::Tracking);
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_base_that_was_restarted_in_mid_run_is_driven_again() {
    let bench = TestBench::start(&[curionav_driver::run], true).await;
    let base = Base::of(&bench);
    bench.set_mission(&["driver"]).await;
    bench.runs().await;
    let mut seq = 0;
    // More ticks than are remembered.
    for tick in 500..580 {
        seq += 1;
        assert_eq!(base.command(tick, Some((1, seq))).await.reason, CommandReason::Tracking, "tick {tick}");
    }
    for tick in 0..20 {
        seq += 1;
        let command = base.command(tick, Some((1, seq))).await;
        // With the first one it forgets all that came before.
        assert!(tick == 0 || command.reason == CommandReason::Tracking, "tick {tick}: {:?}", command.reason);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn for_a_base_that_was_restarted_in_mid_run_is_planned_again() {
    let services = [curionav_driver::run, curionav_trajectory_generator::run, curionav_arbiter::run];
    let mut bench = TestBench::start(&services, true).await;
    bench.host_map();
    let base = Base::of(&bench);
    bench.set_mission(&["arbiter"]).await;
    bench.runs().await;
    let unknown = Reason::PeopleUnknown;
    // Until it has heard that the mission runs.
    let mut tick = 500;
    loop {
        base.say_people(tick);
        let decision = base.decision(tick).await;
        tick += 1;
        if decision.reason != (Reason::MissionNotRunning { state: MissionState::Preparing }) {
            assert_ne!(decision.reason, unknown);
            break;
        }
    }
    // People are still those of the time before.
    assert_eq!(base.decision(0).await.reason, unknown);
    for tick in 1..5 {
        base.say_people(tick);
        assert_ne!(base.decision(tick).await.reason, unknown, "tick {tick}");
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_base_that_was_restarted_in_mid_run_is_where_it_was() {
    let mut bench = TestBench::start(&[curionav_driver::run, curionav_localizer::run], true).await;
    bench.host_map();
    let base = Base::of(&bench);
    bench.set_mission(&["localizer"]).await;
    bench.runs().await;
    // 3 m ahead, on odometry alone.
    for tick in 500..=530 {
        let ahead = Pose2::new(0.1 * (tick - 500) as f64, 0.0, 0.0);
        base.belief_at(tick, ahead).await;
    }
    for tick in 0..5 {
        let belief = base.belief_at(tick, Pose2::default()).await;
        assert!((belief.x - START.x - 3.0).abs() < 0.7, "tick {tick}: x = {:.2} m", belief.x);
    }
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_command_of_the_run_before_does_not_pass_for_what_was_driven() {
    let services = [curionav_driver::run, curionav_trajectory_generator::run, curionav_arbiter::run];
    let mut bench = TestBench::start(&services, true).await;
    bench.host_map();
    let base = Base::of(&bench);
    let reports = bench.inbox::<CycleReport>("report");
    bench.set_mission(&["arbiter"]).await;
    bench.runs().await;
    base.command(20, None).await;
    let next = bench.set_mission(&["arbiter"]).await;
    bench.mission_that(|m| m.run == next.run && m.state == MissionState::Running).await;
    while reports.try_next().is_some() {}
    let mut tick = 0;
    let report = loop {
        base.say_people(tick);
        base.decision(tick).await;
        tick += 1;
        if let Some(report) = reports.try_next() {
            break report;
        }
    };
    assert_eq!(report.driven, None);
}
