use curionav_ros2::messages::{PoseStamped, Time, Uuid};
use curionav_schemas::Refusal;
use curionav_testing::golden;

use super::*;
use crate::goals::Task;
use crate::tour::{Place, PlaceEnd, Tour};

fn mission(revision: u64, state: MissionState, end: Option<MissionEnd>) -> Mission {
    Mission { run: 1, revision, state, end, ..golden::mission() }
}

const NOW: Time = Time { sec: 1, nanosec: 0 };
const GOAL: Uuid = [7; 16];
const KIND: ActionKind = ActionKind::NavigateToPose;

/// A goal of this action with so many places, one metre apart.
fn goal(id: Uuid, kind: ActionKind, places: u32) -> Goal {
    let place = |k: u32| Place {
        pose: PoseStamped::default(),
        destination: (Point2::new(f64::from(k), 0.0), None),
        end: PlaceEnd::Pending,
    };
    Goal::new(id, kind, Task::Tour(Tour::new((1..=places).map(place).collect(), 0, 0)), NOW)
}

/// A goal of the action that runs as revision 3, since tick 10.
fn under_way() -> Journey {
    under_way_to(KIND, 1)
}

/// A goal of this action with so many places that runs as revision 3, since tick 10.
fn under_way_to(kind: ActionKind, places: u32) -> Journey {
    let mut journey = Journey::default();
    assert!(journey.accept(goal(GOAL, kind, places)));
    journey.asked_to_go(1, false);
    let effects = journey.answered(1, Ok(mission(3, MissionState::Preparing, None)), 8);
    assert_eq!(effects, [Effect::Goals]);
    assert_eq!(journey.said(mission(3, MissionState::Running, None), 10), []);
    assert!(journey.is_engaged());
    journey
}

fn status(journey: &Journey) -> (Status, String) {
    let goal = journey.goals.get(&GOAL).unwrap();
    (goal.status, goal.why.clone())
}

fn arrived(tick: u64) -> Decision {
    Decision { tick, arrived: true, ..golden::stop() }
}

#[test]
fn a_robot_that_arrives_has_reached_its_goal() {
    let mut journey = under_way();
    assert_eq!(journey.decided(&arrived(9)), [], "it was decided for the goal before");
    let finish = MissionCommand::Finish { revision: 3, end: MissionEnd::Reached };
    assert_eq!(journey.decided(&arrived(12)), [Effect::Tell(finish)]);
    assert_eq!(journey.decided(&arrived(13)), [], "once is enough");
    let effects = journey.said(mission(3, MissionState::Finished, Some(MissionEnd::Reached)), 14);
    assert_eq!(effects, [Effect::Goals, Effect::NoPlan]);
    assert_eq!((status(&journey).0, journey.is_engaged()), (Status::Succeeded, false));
}

#[test]
fn a_goal_is_canceled_only_if_its_client_gave_it_up() {
    let cancelled = || mission(3, MissionState::Cancelled, Some(MissionEnd::Cancelled));
    let mut journey = under_way();
    journey.goals.cancel(KIND, &Default::default());
    assert_eq!(journey.canceling(), [Effect::Goals, Effect::Tell(MissionCommand::Cancel)]);
    journey.said(cancelled(), 20);
    assert_eq!(status(&journey).0, Status::Canceled);
    let mut journey = under_way();
    journey.said(cancelled(), 20);
    assert_eq!(status(&journey).0, Status::Aborted);
}

#[test]
fn a_goal_given_up_before_the_driver_answers_never_runs() {
    let mut journey = Journey::default();
    journey.accept(goal(GOAL, KIND, 1));
    journey.asked_to_go(1, false);
    journey.goals.cancel(KIND, &Default::default());
    assert_eq!(journey.canceling(), [Effect::Goals]);
    let effects = journey.answered(1, Ok(mission(3, MissionState::Preparing, None)), 8);
    assert_eq!(effects, [Effect::Tell(MissionCommand::Cancel)]);
    journey.said(mission(3, MissionState::Cancelled, Some(MissionEnd::Cancelled)), 9);
    assert_eq!(status(&journey).0, Status::Canceled);
}

#[test]
fn a_new_goal_takes_the_place_of_the_one_before() {
    let mut journey = under_way();
    assert!(!journey.accept(goal(GOAL, KIND, 1)), "a name counts once");
    assert!(journey.accept(goal([8; 16], KIND, 1)));
    assert_eq!(status(&journey).0, Status::Aborted);
    journey.asked_to_go(2, true);
    // What the driver says of the old revision meanwhile concerns no goal any more.
    assert_eq!(journey.said(mission(3, MissionState::Running, None), 20), []);
    journey.answered(2, Ok(mission(4, MissionState::Preparing, None)), 21);
    assert_eq!(journey.goals.active().map(|goal| (goal.id, goal.status)), Some(([8; 16], Status::Executing)));
    assert_eq!(journey.said(mission(3, MissionState::Running, None), 22), [], "it is older");
    journey.said(mission(4, MissionState::Running, None), 23);
    assert_eq!(journey.decided(&arrived(22)), []);
    assert_eq!(journey.decided(&arrived(23)).len(), 1);
}

#[test]
fn another_clients_mission_replaces_the_goal_and_moves_the_base() {
    let mut journey = under_way();
    assert_eq!(journey.said(mission(4, MissionState::Preparing, None), 20), [Effect::Goals]);
    assert_eq!((status(&journey).0, journey.is_engaged()), (Status::Aborted, true));
    journey.said(mission(4, MissionState::Running, None), 22);
    assert_eq!(journey.decided(&arrived(25)).len(), 1, "the base ends that run too");
}

#[test]
fn a_robot_that_only_localises_stands() {
    let mut journey = Journey::default();
    journey.asked_to_localize(1);
    journey.answered(1, Ok(mission(1, MissionState::Preparing, None)), 0);
    assert!(!journey.is_engaged());
    let effects = journey.said(mission(1, MissionState::Running, None), 5);
    assert_eq!((effects, journey.is_engaged()), (vec![Effect::Tell(MissionCommand::Cancel)], false));
    assert_eq!(journey.decided(&arrived(6)), []);
}

#[test]
fn a_state_that_comes_before_the_answer_is_kept_and_moves_no_localising_robot() {
    let mut journey = Journey::default();
    journey.asked_to_localize(1);
    assert_eq!(journey.said(mission(1, MissionState::Running, None), 5), []);
    assert!(!journey.is_engaged());
    let effects = journey.answered(1, Ok(mission(1, MissionState::Preparing, None)), 6);
    assert_eq!((effects, journey.is_engaged()), (vec![Effect::Tell(MissionCommand::Cancel)], false));
    assert!(journey.is_localizing() && journey.running() == Some((1, 1)));
    // A mission of another client came meanwhile: that one moves the robot.
    let mut journey = Journey::default();
    journey.asked_to_localize(1);
    journey.said(mission(2, MissionState::Running, None), 5);
    assert_eq!(journey.answered(1, Ok(mission(1, MissionState::Preparing, None)), 6), []);
    assert!(journey.is_engaged() && !journey.is_localizing());
    // A goal whose mission has ended before the answer has come.
    let mut journey = Journey::default();
    journey.accept(goal(GOAL, KIND, 1));
    journey.asked_to_go(1, false);
    journey.said(mission(3, MissionState::Finished, Some(MissionEnd::Reached)), 20);
    journey.answered(1, Ok(mission(3, MissionState::Preparing, None)), 21);
    assert_eq!((status(&journey).0, journey.is_engaged()), (Status::Succeeded, false));
}

#[test]
fn a_restarted_driver_has_new_missions_even_with_the_same_revision() {
    let of_later_run = |state| Mission { run: 2, ..mission(3, state, None) };
    let mut journey = under_way();
    journey.decided(&arrived(12));
    journey.fail("the robot's clock was set back");
    journey.accept(goal([8; 16], KIND, 1));
    journey.asked_to_go(2, false);
    journey.answered(2, Ok(of_later_run(MissionState::Preparing)), 20);
    assert!(journey.is_engaged(), "only the mission before had failed");
    journey.said(of_later_run(MissionState::Running), 21);
    assert_eq!(journey.decided(&arrived(22)).len(), 1, "only the mission before was told to end");
    // A restart while a goal is under way: it is of no mission any more.
    let mut journey = under_way();
    let fresh = Mission { run: 2, ..mission(1, MissionState::Preparing, None) };
    assert_eq!(journey.said(fresh, 20), [Effect::Goals]);
    assert_eq!(status(&journey).0, Status::Aborted);
}

#[test]
fn a_refused_goal_fails_but_a_refused_change_is_ordered_anew() {
    let reject = || Reject::from(curionav_schemas::Refusal::NoMission);
    let mut journey = Journey::default();
    journey.accept(goal(GOAL, KIND, 1));
    journey.asked_to_go(1, true);
    assert_eq!(journey.answered(1, Err(reject()), 0), [Effect::OrderAnew]);
    assert_eq!(status(&journey).0, Status::Accepted);
    journey.asked_to_go(2, false);
    assert_eq!(journey.answered(2, Err(reject()), 0), [Effect::Goals, Effect::Refused(reject())]);
    assert_eq!(status(&journey).0, Status::Aborted);
    assert!(!status(&journey).1.is_empty());
}

#[test]
fn a_role_that_cannot_prepare_fails_the_goal_and_says_why() {
    let (role, instance) = ("localizer".to_owned(), "a".to_owned());
    let reject = curionav_schemas::Refusal::PoseLost.at("localizer");
    let mut journey = under_way();
    let end = MissionEnd::Unprepared { role, instance, reject };
    journey.said(mission(3, MissionState::Finished, Some(end)), 20);
    assert!(status(&journey).0 == Status::Aborted && status(&journey).1.contains("localizer"));
}

#[test]
fn a_goal_without_a_way_fails_with_the_number_that_nav2_has_for_it() {
    let unprepared = |refusal: Refusal| MissionEnd::Unprepared {
        role: "arbiter".into(),
        instance: "a".into(),
        reject: refusal.at("goal"),
    };
    for (end, error) in [
        (MissionEnd::NoWayToGoal, 208),
        (MissionEnd::GoalOccupied, 206),
        (unprepared(Refusal::UnreachableGoal { x: 1.0, y: 2.0 }), 208),
        (unprepared(Refusal::NoRoomAtGoal { x: 1.0, y: 2.0, room: 0.1, radius: 0.3 }), 206),
        (MissionEnd::Lost, 9000),
    ] {
        let mut journey = under_way();
        journey.said(mission(3, MissionState::Finished, Some(end)), 20);
        let goal = journey.goals.get(&GOAL).unwrap();
        assert_eq!((goal.status, goal.error), (Status::Aborted, error), "{goal:?}");
    }
}

#[test]
fn a_goal_fails_when_the_clock_is_set_back_or_the_driver_goes() {
    let mut journey = under_way();
    let effects = journey.fail("the robot's clock was set back");
    assert_eq!(effects, [Effect::Goals, Effect::Tell(MissionCommand::Cancel), Effect::NoPlan]);
    assert!(!journey.is_engaged());
    journey.said(mission(3, MissionState::Running, None), 21);
    assert!(!journey.is_engaged(), "the driver has not heard of it yet");
    let mut journey = under_way();
    assert_eq!(journey.forget_mission(), [Effect::Goals, Effect::NoPlan]);
    assert!(!journey.is_engaged() && status(&journey).0 == Status::Aborted);
    // A driver that was started anew counts its revisions from 1 on, in a later run.
    let fresh = Mission { run: 2, ..mission(1, MissionState::Preparing, None) };
    journey.said(fresh, 0);
    assert!(journey.is_engaged());
}

/// The driver takes the next place as this revision, and runs.
fn goes_on(journey: &mut Journey, revision: u64, tick: u64) {
    journey.asked_to_go(revision, true);
    journey.answered(revision, Ok(mission(revision, MissionState::Preparing, None)), tick);
    journey.said(mission(revision, MissionState::Running, None), tick);
}

fn to(x: f64) -> Effect {
    Effect::GoOn((Point2::new(x, 0.0), None))
}

#[test]
fn a_tour_stops_at_each_waypoint_and_ends_at_the_last() {
    let mut journey = under_way_to(ActionKind::FollowWaypoints, 2);
    assert_eq!(journey.is_at(Point2::new(1.0, 0.0)), [], "to be near is not to arrive");
    assert_eq!(journey.decided(&arrived(12)), [to(2.0)]);
    assert_eq!(journey.decided(&arrived(13)), [], "once is enough");
    goes_on(&mut journey, 4, 14);
    let finish = MissionCommand::Finish { revision: 4, end: MissionEnd::Reached };
    assert_eq!(journey.decided(&arrived(16)), [Effect::Tell(finish)]);
    journey.said(mission(4, MissionState::Finished, Some(MissionEnd::Reached)), 17);
    assert_eq!(status(&journey).0, Status::Succeeded);
}

#[test]
fn a_waypoint_that_cannot_be_reached_is_left_out_and_named() {
    let mut journey = under_way_to(ActionKind::FollowWaypoints, 2);
    let effects = journey.said(mission(3, MissionState::Finished, Some(MissionEnd::NoWayToGoal)), 12);
    assert_eq!(effects[0], to(2.0));
    goes_on(&mut journey, 4, 14);
    journey.said(mission(4, MissionState::Finished, Some(MissionEnd::GoalOccupied)), 17);
    let goal = journey.goals.get(&GOAL).unwrap();
    assert_eq!((goal.status, goal.error), (Status::Succeeded, 0));
    let missed = goal.tour().unwrap().places().iter().map(|place| match &place.end {
        PlaceEnd::Missed(error, why) if !why.is_empty() => *error,
        _ => 0,
    });
    assert_eq!(missed.collect::<Vec<_>>(), [208, 206]);
    // A robot that is lost does not go on.
    let mut journey = under_way_to(ActionKind::FollowWaypoints, 2);
    journey.said(mission(3, MissionState::Finished, Some(MissionEnd::Lost)), 12);
    assert_eq!((status(&journey).0, journey.goals.get(&GOAL).unwrap().error), (Status::Aborted, 600));
}

#[test]
fn a_way_through_poses_goes_on_before_the_robot_has_arrived() {
    let mut journey = under_way_to(ActionKind::NavigateThroughPoses, 2);
    assert_eq!(journey.is_at(Point2::new(0.1, 0.0)), [], "it is too far");
    assert_eq!(journey.is_at(Point2::new(0.5, 0.0)), [to(2.0)]);
    assert_eq!(journey.is_at(Point2::new(0.6, 0.0)), [], "once is enough");
    goes_on(&mut journey, 4, 14);
    assert_eq!(journey.is_at(Point2::new(2.0, 0.0)), [], "the last one is to be reached");
    journey.said(mission(4, MissionState::Finished, Some(MissionEnd::NoWayToGoal)), 17);
    assert_eq!((status(&journey).0, journey.goals.get(&GOAL).unwrap().error), (Status::Aborted, 308));
}
