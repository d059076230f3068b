use std::path::Path;
use std::process::Command;

use curionav_planning::generation::GeneratorPart;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::RobotModel;
use curionav_planning::occupancy::{GeodesicField, StaticMap};
use curionav_planning::profile::Profile;
use curionav_planning::scene::{Belief, People, Scene};
use nalgebra::Matrix3;

use super::*;

/// A planner whose answers are lines of a shell's `case`.
fn planner(folder: &Path, cases: &str) -> Source {
    let file = folder.join("planner");
    let script = format!("#!/bin/sh\nwhile read -r line; do\ncase \"$line\" in\n{cases}\nesac\ndone\n");
    // Another process writes it: one that this process still had open for writing could not be started.
    let written = Command::new("sh")
        .args(["-c", "printf %s \"$1\" > \"$2\" && chmod +x \"$2\"", "write", &script])
        .arg(&file)
        .status();
    assert!(written.unwrap().success());
    Source::Program(file)
}

const HELLO: &str = "*hello*) echo '{\"name\": \"test\", \"answer_within_s\": 5}';;\n*begin*) echo '{}';;\n";

/// Lets `ask` ask about a robot that stands in an empty room.
fn in_a_room<R>(ask: impl FnOnce(&GenerationInput<'_>, &Run<'_>) -> R) -> R {
    let grid = OccupancyGrid::new(120, 120, 0.1, Pose2::new(-6.0, -6.0, 0.0), vec![0; 14_400]).unwrap();
    let map = StaticMap::new(grid);
    let goal = Point2::new(4.0, 0.0);
    let geodesic = GeodesicField::new(&map, goal, 0.3);
    let belief = Belief { pose: Pose2::default(), covariance: Matrix3::zeros(), twist: Default::default() };
    let scene = Scene::new(belief, People::walking(0.25, &[[1.0, 2.0, 0.5, 0.0]]));
    let params: GeneratorPart = Profile::default().generator_part();
    let robot = RobotModel::default();
    let input = GenerationInput {
        params: &params,
        map: &map,
        goal,
        geodesic: &geodesic,
        information: None,
        robot: &robot,
        scene: &scene,
        previous: None,
        seed: 1,
    };
    ask(&input, &Run { robot: "robot", map: &map.grid, seed: 1 })
}

/// The candidates of so many cycles of one run, and what became of the questions.
fn run(attended: &mut Attended, cycles: usize) -> (Vec<usize>, Tally) {
    in_a_room(|input, run| {
        attended.begin(run, input);
        let offered = (0..cycles).map(|_| attended.candidates(input, None, START).len()).collect();
        (offered, attended.tally().clone())
    })
}

#[test]
fn a_good_planner_is_asked_in_every_cycle_and_nothing_is_counted_against_it() {
    let folder = tempfile::tempdir().unwrap();
    let cases = format!("{HELLO}*) echo '{{\"v\": 0.5, \"omega\": 0}}';;");
    let mut attended = Attended::start(planner(folder.path(), &cases)).unwrap();
    for _ in 0..2 {
        let (offered, tally) = run(&mut attended, 3);
        assert_eq!((offered, tally), (vec![1; 3], Tally { asked: 3, ..Tally::default() }));
    }
}

#[test]
fn errors_and_what_is_no_answer_cost_their_cycles_alone() {
    let folder = tempfile::tempdir().unwrap();
    // The second line that is no `hello` or `begin` gets a NaN, the third an error.
    let cases = format!(
        "{HELLO}*) n=$((n+1)); case $n in 2) echo '{{\"v\": NaN, \"omega\": 0}}';; \
         3) echo '{{\"error\": \"no idea\"}}';; *) echo '{{\"v\": 0.5, \"omega\": 0}}';; esac;;"
    );
    let mut attended = Attended::start(planner(folder.path(), &cases)).unwrap();
    let (offered, tally) = run(&mut attended, 4);
    assert_eq!(offered, [1, 0, 0, 1]);
    assert_eq!((tally.refused, tally.errors, tally.deaths, tally.late), (1, 1, 0, 0));
    assert!(tally.first_fault.unwrap().contains("not finite"));
}

#[test]
fn a_planner_that_dies_is_started_again_with_the_next_run() {
    let folder = tempfile::tempdir().unwrap();
    let cases = format!("{HELLO}*) echo it broke >&2; exit 3;;");
    let mut attended = Attended::start(planner(folder.path(), &cases)).unwrap();
    for _ in 0..2 {
        let (offered, tally) = run(&mut attended, 3);
        assert_eq!((offered, tally.asked, tally.deaths), (vec![0; 3], 3, 1));
        assert!(tally.first_fault.unwrap().ends_with("it broke"));
    }
}

#[test]
fn a_planner_that_sleeps_is_late_three_times_and_then_ended() {
    let folder = tempfile::tempdir().unwrap();
    let cases = "*hello*) echo '{\"name\": \"test\", \"answer_within_s\": 0.02}';;\n*begin*) echo '{}';;\n\
                 *) exec sleep 600;;";
    let mut attended = Attended::start(planner(folder.path(), cases)).unwrap();
    let (offered, tally) = run(&mut attended, 5);
    assert_eq!((offered, tally.asked, tally.late, tally.deaths), (vec![0; 5], 5, 3, 1));
    assert_eq!(tally.first_fault.as_deref(), Some("no answer within 0.02 s"));
}

#[test]
fn the_cells_of_a_map_are_sent_once_to_a_planner_that_asks_for_them() {
    let folder = tempfile::tempdir().unwrap();
    let cases = "*hello*) echo '{\"name\": \"test\", \"map\": true}';;\n*begin*cells*) echo '{}';;\n\
                 *begin*) echo '{\"error\": \"no cells\"}';;\n*) echo '{\"v\": 0.5, \"omega\": 0}';;";
    let mut attended = Attended::start(planner(folder.path(), cases)).unwrap();
    assert_eq!(run(&mut attended, 1).0, [1]);
    let (offered, tally) = run(&mut attended, 1);
    assert_eq!((offered, tally.errors, tally.first_fault.as_deref()), (vec![0], 1, Some("no cells")));
}

#[test]
fn what_is_no_planner_is_refused_with_what_mends_it() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |cases: &str| {
        let error = Attended::start(planner(folder.path(), cases)).err().unwrap();
        format!("{error:#}")
    };
    assert!(refused("*) echo '{\"error\": \"there is no policy\"}';;").ends_with("there is no policy"));
    assert!(refused("*) echo hello;;").contains("it answered `hello` with `hello`"));
    assert!(refused("*) echo oh >&2; exit 1;;").contains("oh; "));
    assert!(refused("*) echo '{\"name\": \"dwa\"}';;").contains("built-in"));
}
