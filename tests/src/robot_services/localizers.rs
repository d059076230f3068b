//! A second localizer of one robot.

use std::time::{Duration, Instant};

use curionav_planning::geometry::Pose2;
use curionav_runtime::config::ServiceConfig;
use curionav_schemas::{Confidence, MissionEnd, MissionState, Refusal};

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

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_localizer_that_is_started_again_goes_on_from_the_kept_pose_in_doubt() {
    let folder = tempfile::tempdir().unwrap();
    let keep_pose = Some(folder.path().join("pose.json"));
    let config = ServiceConfig { simulated_base: true, keep_pose, ..ServiceConfig::default() };
    let mut bench =
        TestBench::configured(&[curionav_driver::run, curionav_localizer::run], config.clone()).await;
    bench.host_map();
    let base = Base::of(&bench);
    bench.set_mission(&["localizer"]).await;
    bench.runs().await;
    let driven = |tick: u64| Pose2::new(0.05 * tick as f64, 0.0, 0.0);
    let first = base.belief_at(0, driven(0)).await;
    for tick in 1..=30 {
        base.belief_at(tick, driven(tick)).await;
    }
    bench.end_one(1).await;
    bench.add(curionav_localizer::run, ServiceConfig { instance: "b".into(), ..config }).await;
    // The second waits for a second, lest the first is only slow.
    let mut tick = 40;
    let resumed = loop {
        base.say_odometry(tick, driven(tick));
        if let Ok(belief) = tokio::time::timeout(Duration::from_millis(100), base.belief_since(40)).await {
            break belief;
        }
        tick += 1;
    };
    let way = (resumed.x - first.x).hypot(resumed.y - first.y);
    assert!((way - driven(resumed.tick).x).abs() < 0.05, "{way} m after {} ticks", resumed.tick);
    assert_eq!(resumed.health.confidence, Confidence::Doubtful);
    let mission = bench.mission_that(|_| true).await;
    assert_eq!((mission.state, &mission.end), (MissionState::Running, &None));
}
