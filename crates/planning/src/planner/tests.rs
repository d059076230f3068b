use nalgebra::Matrix3;

use super::*;
use crate::evaluation::{Costs, each};
use crate::geometry::Twist;
use crate::occupancy::OccupancyGrid;
use crate::profile::Term;
use crate::tracking::track;

const CELLS: i32 = 120;

/// A walled hall of 12 m by 12 m with a wall across it, which leaves a gap of 4 m at the top.
fn hall() -> Arc<StaticMap> {
    let is_wall = |c: i32, r: i32| [c, r].iter().any(|i| [0, CELLS - 1].contains(i)) || c == 60 && r < 80;
    let cells = (0..CELLS * CELLS).map(|i| if is_wall(i % CELLS, i / CELLS) { 100 } else { 0 }).collect();
    Arc::new(StaticMap::new(OccupancyGrid::new(120, 120, 0.1, Pose2::default(), cells).unwrap()))
}

fn planner(profile: Profile) -> Planner {
    Planner::new(hall(), profile, RobotModel::default()).unwrap()
}

fn belief(pose: Pose2, twist: Twist) -> Belief {
    Belief { pose, covariance: Matrix3::from_diagonal_element(1e-4), twist }
}

fn at(x: f64, y: f64) -> Belief {
    belief(Pose2::new(x, y, 0.0), Twist::default())
}

#[test]
fn it_drives_round_the_wall_to_the_goal_and_stops_there() {
    let mut planner = planner(Profile::default());
    planner.set_goal(Point2::new(10.0, 2.0)).unwrap();
    let person = People::walking(0.25, &[[6.0, 10.0, 0.0, 0.0]]);
    let robot = RobotModel::default();
    let mut pose = Pose2::new(2.0, 2.0, 0.0);
    let mut twist = Twist::default();
    let mut high = 0.0_f64;
    for tick in 0..300 {
        let verdict = planner.cycle(belief(pose, twist), &person, 0.3 * f64::from(tick)).unwrap();
        if verdict.decision.arrived {
            assert!(pose.position().distance(Point2::new(10.0, 2.0)) < 0.5);
            assert!(high > 8.0, "it went through the wall");
            assert_eq!(planner.last().unwrap().scene.tick, tick as u64);
            return;
        }
        for k in 0..3 {
            let command = track(&verdict.decision.trajectory, 0.1 * f64::from(k), pose, twist, &robot, 0.1);
            twist = command;
            pose = crate::motion::step(pose, twist, 0.1);
            high = high.max(pose.y);
        }
    }
    panic!("it has not arrived, but is at {pose:?}");
}

#[test]
fn what_is_on_no_map_is_gone_around_and_a_closed_way_is_known() {
    let mut planner = planner(Profile::default());
    let start = Point2::new(2.0, 2.0);
    assert_eq!(planner.set_obstacles(Obstacles::default()), Err(NoGoal));
    planner.set_goal(Point2::new(10.0, 2.0)).unwrap();
    let plain = planner.cycle(at(2.0, 2.0), &People::default(), 0.0).unwrap();
    // The gap in the wall is from row 80 on; a barrier leaves the last metre of it, then nothing.
    let barrier = |end: u32| Obstacles::of((78..end).map(|row| row * 120 + 60).collect());
    planner.set_obstacles(barrier(108)).unwrap();
    assert_eq!(planner.is_closed(start, 0.5), Ok(false));
    planner.set_obstacles(barrier(119)).unwrap();
    assert_eq!(planner.is_closed(start, 0.5), Ok(true));
    let closed = planner.cycle(at(2.0, 2.0), &People::default(), 0.3).unwrap();
    assert!(!planner.last().unwrap().scene.obstacles.is_empty());
    assert_ne!(closed, plain);
    planner.set_obstacles(Obstacles::default()).unwrap();
    assert_eq!(planner.is_closed(start, 0.5), Ok(false));
    planner.set_goal(Point2::new(10.0, 2.0)).unwrap();
    let again = planner.cycle_of_tick(0, at(2.0, 2.0), &People::default(), 0.0).unwrap();
    assert_eq!(again, plain);
}

#[test]
fn the_same_calls_give_the_same_verdicts_and_the_seed_changes_them() {
    let drive = |seed: u64| {
        let mut planner = planner(Profile::default()).with_seed(seed);
        planner.set_goal(Point2::new(10.0, 2.0)).unwrap();
        let cycle =
            |k: i32| planner.cycle(at(2.0 + 0.1 * f64::from(k), 2.0), &People::default(), 0.3 * f64::from(k));
        (0..5).map(cycle).map(Result::unwrap).collect::<Vec<_>>()
    };
    assert_eq!(drive(1), drive(1));
    assert_ne!(drive(1), drive(2));
}

#[test]
fn a_new_goal_is_planned_for_as_if_it_were_the_first() {
    let goal = Point2::new(10.0, 2.0);
    let mut fresh = planner(Profile::default());
    fresh.set_goal(goal).unwrap();
    let mut used = planner(Profile::default());
    used.set_goal(Point2::new(2.0, 10.0)).unwrap();
    used.cycle(at(2.0, 2.0), &People::default(), 0.0).unwrap();
    used.set_goal(goal).unwrap();
    let verdicts = [&mut fresh, &mut used]
        .map(|planner| planner.cycle_of_tick(7, at(2.0, 2.0), &People::default(), 1.0).unwrap());
    assert_eq!(verdicts[0], verdicts[1]);
}

/// Term `left`: what lies at smaller y costs.
struct Left;

impl Evaluator for Left {
    fn evaluate(&self, _: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        each(candidates, should_stop, |i| (20.0 - candidates.end(i).y).max(0.0))
    }
}

#[test]
fn a_term_of_the_callers_own_decides() {
    let mut profile = Profile::default();
    profile.terms.insert("left".to_owned(), Term::new(1.0, 100.0));
    let mut without = planner(profile.clone());
    let goal = Point2::new(10.0, 2.0);
    assert_eq!(without.set_goal(goal), Err(PlannerError::NoEvaluator { term: "left".to_owned() }));
    let mut with = planner(profile).with_term("left", Arc::new(Left));
    with.set_goal(goal).unwrap();
    let verdict = with.cycle(at(3.0, 5.0), &People::default(), 0.0).unwrap();
    let candidates = &with.last().unwrap().candidates;
    let highest = (0..candidates.len()).map(|i| candidates.end(i).y).fold(f64::MIN, f64::max);
    assert!(candidates.end(verdict.chosen.unwrap()).y > highest - 0.2);
}

#[test]
fn what_cannot_be_planned_is_an_error() {
    let mut planner = planner(Profile::default());
    assert_eq!(planner.cycle(at(2.0, 2.0), &People::default(), 0.0), Err(NoGoal));
    let in_the_wall = planner.set_goal(Point2::new(6.05, 2.0));
    assert_eq!(in_the_wall, Err(PlannerError::GoalNotFree { x: 6.05, y: 2.0 }));
    assert!(in_the_wall.unwrap_err().to_string().contains("not free"));
    let broken = Profile { dt: -1.0, ..Profile::default() };
    let refused = Planner::new(hall(), broken, RobotModel::default()).err().unwrap();
    assert!(refused.to_string().starts_with("profile: dt: "), "{refused}");
    let unknown = Profile { generator: "magic".to_owned(), ..Profile::default() };
    let mut unable = Planner::new(hall(), unknown, RobotModel::default()).unwrap();
    let refused = unable.set_goal(Point2::new(10.0, 2.0));
    assert!(refused.unwrap_err().to_string().contains("rrt-star"));
}

#[test]
fn from_a_room_without_a_door_there_is_no_way() {
    let cells = (0..CELLS * CELLS).map(|i| if i % CELLS == 60 { 100 } else { 0 }).collect();
    let rooms = OccupancyGrid::new(120, 120, 0.1, Pose2::default(), cells).unwrap();
    let map = Arc::new(StaticMap::new(rooms));
    let mut planner = Planner::new(map, Profile::default(), RobotModel::default()).unwrap();
    assert_eq!(planner.has_way(Point2::new(2.0, 2.0)), Err(NoGoal));
    planner.set_goal(Point2::new(10.0, 2.0)).unwrap();
    assert_eq!(planner.has_way(Point2::new(2.0, 2.0)), Ok(false));
    assert_eq!(planner.has_way(Point2::new(8.0, 10.0)), Ok(true));
}
