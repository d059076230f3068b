//! A second localizer of one robot.

use std::time::{Duration, Instant};

use curionav_planning::geometry::Pose2;
use curionav_runtime::config::ServiceConfig;
use curionav_schemas::{MissionEnd, MissionState, Refusal};

use super::base::Base;
use super::test_bench::TestBench;

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_second_localizer_ends_a_mission_only_once_the_first_has_gone() {
    let mut bench = TestBench::start(&[curionav_driver::run, curionav_localizer::run], true).await;
    bench.host_map();
    let base = Base::of(&bench);
    bench.set_mission(&["localizer"]).await;
    bench.runs().await;
    base.belief_at(0, Pose2::default()).await;
    let second = ServiceConfig { instance: "b".into(), simulated_base: true, ..ServiceConfig::default() };
    bench.add(curionav_localizer::run, second).await;
    let begun = Instant::now();
    let mut tick = 1;
    while begun.elapsed() < Duration::from_secs(3) {
        base.belief_at(tick, Pose2::default()).await;
        tick += 1;
        tokio::time::sleep(Duration::from_millis(50)).await;
    }
    let goes_on = bench.mission_that(|_| true).await;
    assert_eq!((goes_on.state, &goes_on.end), (MissionState::Running, &None));
    bench.end_one(1).await;
    let over = bench.mission_that(|mission| mission.state == MissionState::Finished).await;
    assert!(
        matches!(&over.end, Some(MissionEnd::Unprepared { role, instance, reject })
            if role == "localizer" && instance == "b" && reject.why == Refusal::PoseLost),
        "{:?}",
        over.end
    );
}
