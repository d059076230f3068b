//! Goals that no robot can reach: the arbiter knows, and the driver says so to everyone.

use curionav_schemas::{Clock, Mission, MissionCommand, MissionEnd, MissionState, Refusal};

use super::test_bench::TestBench;
use crate::faults::corridor_map::START;

/// What becomes of the goal at this place.
async fn end_of(bench: &TestBench, (x, y): (f64, f64)) -> Mission {
    let asked = bench.request(MissionCommand::Goal { x, y, heading: None, way: None }).await;
    let settled =
        |mission: &Mission| mission.revision == asked.revision && mission.state != MissionState::Preparing;
    bench.mission_that(settled).await
}

#[tokio::test(flavor = "multi_thread", worker_threads = 2)]
async fn a_goal_near_which_the_robot_fits_nowhere_is_refused_with_the_room_that_there_is() {
    let mut bench = TestBench::start(&[curionav_driver::run, curionav_arbiter::run], true).await;
    bench.host_map();
    let mut order = TestBench::order(Clock::Realtime, &["arbiter"]);
    order.goal_tolerance = 0.05;
    bench.request(MissionCommand::Set { order: Box::new(order) }).await;
    bench.runs().await;
    // Into the wall of the corridor, which begins at 7.8 m: from where it fits to where it does not.
    let mut refused = None;
    for step in 0..5 {
        let y = 7.4 + 0.1 * f64::from(step);
        let mission = end_of(&bench, (START.x + 2.0, y)).await;
        let Some(MissionEnd::Unprepared { role, reject, .. }) = mission.end else { continue };
        assert_eq!((role.as_str(), reject.field.as_deref()), ("arbiter", Some("goal")));
        refused = Some((y, reject));
        break;
    }
    let (y, reject) = refused.expect("no goal was refused");
    let Refusal::NoRoomAtGoal { room, radius, .. } = reject.why else { panic!("{reject:?}") };
    assert!(room < radius && y > 7.4, "{room} {radius} {y}");
    let words = reject.to_string();
    assert!(words.starts_with("goal: (") && words.contains("give a goal farther from walls"), "{words}");
    // The robot takes the next goal.
    assert_eq!(end_of(&bench, (START.x + 2.0, START.y)).await.state, MissionState::Running);
}
