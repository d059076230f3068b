//! Goals at which people stand, or near which they do.

use super::program::{RunJson, quickstart_with, run, turn};

/// Where the quickstart's robot is sent.
const GOAL: (f64, f64) = (11.0, 5.2);

/// The quickstart with this one person instead of its people.
fn with_person(person: &str, planner: &str) -> (RunJson, i32) {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("goal.toml");
    std::fs::write(&file, quickstart_with(&format!("[[walkers]]\n{person}"), planner)).unwrap();
    run(file.to_str().unwrap(), &[])
}

fn standing(ahead: f64, left: f64, planner: &str) -> (RunJson, i32) {
    let (x, y) = GOAL;
    with_person(&format!("route = [[{}, {}]]\nmode = \"stand\"", x + ahead, y + left), planner)
}

#[test]
fn before_a_person_who_stays_at_the_goal_the_robot_waits_politely_and_gives_up() {
    let _turn = turn();
    for planner in ["curionav", "curiosity", "mppi", "dwa"] {
        let (json, status) = standing(0.0, 0.0, planner);
        assert_eq!((json.outcome.as_str(), status), ("no_way", 1), "{planner}: {json:?}");
        assert!(json.cycles.other_choice["waits_for_goal"] >= 80, "{planner}: {json:?}");
        assert!(json.metrics.clearance_min_m > 0.4, "{planner}: {json:?}");
        assert!(json.metrics.time_s < 60.0, "{planner}: {json:?}");
    }
}

#[test]
fn a_goal_that_a_person_leaves_is_reached() {
    let _turn = turn();
    let person = "route = [[11.0, 5.2], [11.0, 8.2]]\nspeed = 0.8\nstart_offset = 5.0\npause_s = 20.0";
    for planner in ["curionav", "curiosity", "mppi", "dwa"] {
        let (json, status) = with_person(person, planner);
        assert_eq!((json.outcome.as_str(), status), ("reached", 0), "{planner}: {json:?}");
        assert!(json.cycles.other_choice["waits_for_goal"] > 5, "{planner}: {json:?}");
    }
}

/// A robot has to come near to a person who stands 0.6 m from its goal, and does not circle there.
#[test]
fn a_person_near_the_goal_costs_little_time() {
    let _turn = turn();
    for (ahead, left) in [(0.6, 0.0), (-0.6, 0.0), (0.0, 0.6), (0.0, -0.6)] {
        let (json, status) = standing(ahead, left, "curionav");
        let plain = standing(ahead, left, "distance-only").0;
        assert_eq!((json.outcome.as_str(), status), ("reached", 0), "{json:?}");
        let ratio = json.metrics.time_s / plain.metrics.time_s;
        println!("{ahead} m ahead, {left} m to the left: {:.1} s, {ratio:.2} times", json.metrics.time_s);
        assert!(ratio < 1.3, "{json:?}\n{plain:?}");
    }
}
