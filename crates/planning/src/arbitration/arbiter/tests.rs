use std::cell::Cell;

use super::*;
use crate::collision::Obstacle;
use crate::geometry::{Pose2, Twist};
use crate::numerics::sin_cos;
use crate::profile::Normalisation;

mod explanation;
mod hall;
mod properties;

use hall::{DT, Hall, STEPS, fan, previous, scores, three};

#[test]
fn curiosity_counts_only_while_uncertain() {
    let s = scores(&[("cnc", &[0.0; 3]), ("distance", &[180.0, 182.0, 182.0]), ("cpc", &[9.0, 0.9, 0.8])]);
    assert_eq!(Hall::new().arbitrate(&three(), &s, None).decision.candidate, Some(5));
    assert_eq!(Hall::uncertain().arbitrate(&three(), &s, None).decision.candidate, Some(8));
    // and while certain, what it says or whether it says anything makes no difference at all
    let without = scores(&[("cnc", &[0.0; 3]), ("distance", &[180.0, 182.0, 182.0])]);
    assert_eq!(Hall::new().arbitrate(&three(), &s, None), Hall::new().arbitrate(&three(), &without, None));
}
#[test]
fn distance_only_listens_to_no_other_term() {
    let mut hall = Hall::uncertain();
    hall.profile = Profile::builtin("distance-only").unwrap();
    let s =
        scores(&[("cnc", &[9.0, 0.0, 0.0]), ("distance", &[180.0, 182.0, 182.0]), ("cpc", &[9.0, 0.0, 0.0])]);
    assert_eq!(hall.arbitrate(&three(), &s, None).decision.candidate, Some(5));
}

#[test]
fn ties_go_to_the_lower_id() {
    let s = scores(&[("cnc", &[1.0; 3]), ("distance", &[1.0; 3])]);
    let verdict = Hall::new().arbitrate(&three(), &s, None);
    assert_eq!((verdict.decision.candidate, verdict.chosen), (Some(3), Some(1)));
    assert_eq!(verdict.decision.reason, Reason::LeastCost);
    assert_eq!(verdict.decision.trajectory, Trajectory::of(&three(), 1, Hall::new().scene.belief.motion()));
    assert_eq!(verdict.decision.valid_for, 1.2);
}

#[test]
fn the_best_that_is_free_is_followed_and_no_more_is_checked_than_needed() {
    let mut hall = Hall::new();
    hall.add_person(22.0, 20.0);
    let s = scores(&[("cnc", &[0.0; 3]), ("distance", &[10.0, 30.0, 20.0])]);
    let verdict = hall.arbitrate(&three(), &s, None);
    assert_eq!(verdict.decision.candidate, Some(8));
    let Some(Rejection::Collides(collision)) = &verdict.rejected[0] else { panic!("{:?}", verdict.rejected) };
    assert_eq!(collision.with, Obstacle::Person(0));
    assert_eq!(verdict.rejected[1..], [None, None]);
    assert_eq!(verdict.decision.reason, Reason::LeastCostFree);

    let checks = Cell::new(0);
    let free = |_: &Trajectory| {
        checks.set(checks.get() + 1);
        None
    };
    assert_eq!(decide(&hall.context(&three(), None), &s, &free).decision.candidate, Some(5));
    assert_eq!(checks.get(), 1);
}

#[test]
fn slow_candidates_compete_only_if_no_faster_one_is_free() {
    let mut hall = Hall::new();
    // The one that hardly moves is by far the cheapest.
    let candidates = fan(&[(0, 0.0, 0.8), (1, 0.7, 0.1), (2, -0.7, 0.16)]);
    let s = scores(&[("cnc", &[9.0, 0.0, 0.5]), ("distance", &[99.0, 0.0, 0.0])]);
    let verdict = hall.arbitrate(&candidates, &s, None);
    assert_eq!(verdict.decision.candidate, Some(0));
    assert_eq!(verdict.rejected, [None, Some(Rejection::Slow), Some(Rejection::Slow)]);
    hall.add_person(22.0, 20.0);
    let blocked = hall.arbitrate(&candidates, &s, None).decision;
    assert_eq!((blocked.candidate, blocked.reason), (Some(1), Reason::OnlySlowFree));
}

#[test]
fn what_is_slow_depends_on_how_fast_the_robot_can_be_within_the_horizon() {
    // From rest, and with a stop at the end, the fastest way takes 0.49 m/s on average, at cruise 0.74 m/s.
    let candidates = fan(&[(0, 0.0, 0.8), (1, 0.7, 0.2)]);
    let s = scores(&[("cnc", &[0.0, 0.0]), ("distance", &[99.0, 0.0])]);
    let mut hall = Hall::new();
    hall.scene.belief.twist.v = 0.0;
    assert_eq!(hall.arbitrate(&candidates, &s, None).decision.candidate, Some(1));
    hall.scene.belief.twist.v = 1.0;
    assert_eq!(hall.arbitrate(&candidates, &s, None).decision.candidate, Some(0));
}

#[test]
fn turning_towards_a_way_behind_is_not_slowness() {
    let candidates = fan(&[(0, 0.0, 0.8), (1, 0.74, 0.1), (2, -2.5, 0.1)]);
    let s = scores(&[("cnc", &[0.0; 3]), ("distance", &[99.0, 0.0, 50.0])]);
    let verdict = Hall::new().arbitrate(&candidates, &s, None);
    assert_eq!((verdict.decision.candidate, verdict.decision.reason), (Some(2), Reason::LeastCost));
    assert_eq!(verdict.rejected[1], Some(Rejection::Slow));
}

#[test]
fn slowing_down_at_the_goal_is_not_slowness() {
    let mut hall = Hall::new();
    hall.goal = Point2::new(20.9, 20.0);
    // 0.2 m/s for 3.9 s ends 0.12 m from the goal
    let candidates = fan(&[(0, 0.0, 0.8), (1, 0.0, 0.2)]);
    let s = scores(&[("cnc", &[0.0, 0.0]), ("distance", &[14.0, 6.0])]);
    assert_eq!(hall.arbitrate(&candidates, &s, None).decision.candidate, Some(1));
}

#[test]
fn near_the_goal_the_robot_has_arrived() {
    let mut hall = Hall::new();
    let s = scores(&[("cnc", &[0.0; 3]), ("distance", &[0.0; 3])]);
    hall.goal = Point2::new(20.29, 20.0);
    let decision = hall.arbitrate(&three(), &s, None).decision;
    assert_eq!((decision.action, decision.arrived), (Action::Stop, true));
    hall.goal = Point2::new(20.31, 20.0);
    assert!(!hall.arbitrate(&three(), &s, None).decision.arrived);
}

#[test]
fn a_robot_that_is_not_sure_to_be_at_its_goal_goes_on_while_it_comes_nearer() {
    let mut hall = Hall::new();
    hall.goal = Point2::new(20.2, 20.0);
    hall.profile.goal.sigma_factor = 2.0;
    let [ahead, aside, past] = [(0.0, 0.05), (2.0, 0.05), (0.0, 0.3)].map(|(to, v)| fan(&[(4, to, v)]));
    let s = scores(&[("cnc", &[0.0]), ("distance", &[0.0])]);
    let arrives = |hall: &Hall, candidates: &CandidateSet| {
        let decision = hall.arbitrate(candidates, &s, None).decision;
        assert_eq!(decision.arrived, decision.reason == Reason::Arrived);
        decision.arrived
    };
    // sigma is 0.03 m here: 0.2 m and twice that are within the tolerance of 0.5 m
    assert!(arrives(&hall, &ahead));
    hall.scene.belief.covariance *= 40.0;
    assert!(!arrives(&hall, &ahead));
    assert!(arrives(&hall, &aside), "what leads away is no reason to go on");
    assert!(arrives(&hall, &past), "neither is what leads past the goal");
    hall.scene.in_place = 4.9;
    assert!(!arrives(&hall, &ahead));
    hall.scene.in_place = 5.1;
    assert!(arrives(&hall, &ahead), "and it does not try for ever");
    hall.scene.in_place = 0.0;
    hall.add_person(20.4, 20.0);
    assert!(arrives(&hall, &ahead), "what collides is neither");
    assert!(arrives(&hall, &CandidateSet::empty(STEPS, DT)));
}

#[test]
fn at_its_goal_the_robot_turns_to_the_heading_that_is_asked_for_and_then_has_arrived() {
    for heading in [3.0, -2.0, 0.3, -0.05] {
        let mut hall = Hall::new();
        hall.goal = hall.scene.belief.pose.position();
        hall.goal_heading = Some(heading);
        hall.scene.belief.twist = Twist::default();
        let cycles = (0..40).find(|_| {
            let decision = hall.arbitrate(&CandidateSet::empty(STEPS, DT), &Scores::new(0), None).decision;
            if decision.action == Action::Follow {
                assert_eq!((decision.reason, decision.arrived), (Reason::TurnsToHeading, false));
                let belief = &mut hall.scene.belief;
                (belief.pose, belief.twist) = decision.trajectory.states().at(0);
            }
            decision.action == Action::Stop
        });
        let off = wrap_angle(hall.scene.belief.pose.heading - heading).abs();
        assert!(cycles.is_some() && off < 0.1, "{heading} rad: {cycles:?}, {off} rad off");
        assert!(hall.scene.belief.twist.omega.abs() < 0.2, "it stands");
    }
    // Beside people a disc turns, and a box waits for room: it is wider across.
    let mut hall = Hall::new();
    hall.goal = hall.scene.belief.pose.position();
    hall.goal_heading = Some(1.6);
    hall.scene.belief.twist = Twist::default();
    hall.add_person(20.0, 20.7);
    let turns = |hall: &Hall| hall.arbitrate(&CandidateSet::empty(STEPS, DT), &Scores::new(0), None).decision;
    assert_eq!((turns(&hall).reason, turns(&hall).action), (Reason::TurnsToHeading, Action::Follow));
    let corners = [(-0.5, -0.2), (0.5, -0.2), (0.5, 0.2), (-0.5, 0.2)];
    let vertices = corners.map(|(x, y)| Point2::new(x, y)).into();
    hall.robot.footprint = Footprint::Polygon { vertices };
    assert_eq!((turns(&hall).reason, turns(&hall).action), (Reason::TurnsToHeading, Action::Stop));
    // It has tried for long enough.
    let mut hall = Hall::new();
    hall.goal = hall.scene.belief.pose.position();
    hall.goal_heading = Some(3.0);
    hall.scene.in_place = 20.0;
    assert!(hall.arbitrate(&CandidateSet::empty(STEPS, DT), &Scores::new(0), None).decision.arrived);
}

#[test]
fn the_robot_waits_where_people_stand_at_the_goal_and_leave_no_room() {
    let reason = |at: &[(f64, f64)], goal: f64, speed: f64| {
        let mut hall = Hall::new();
        hall.scene.belief.twist.v = 0.0;
        hall.goal = Point2::new(20.0 + goal, 20.0);
        for &(x, y) in at {
            hall.add_person(20.0 + goal + x, 20.0 + y);
        }
        hall.scene.people.vx.fill(speed);
        let s = scores(&[("cnc", &[0.0, 1.0, 2.0]), ("distance", &[1.0, 1.0, 1.0])]);
        hall.arbitrate(&three(), &s, None).decision.reason
    };
    let waits = |at: &[(f64, f64)], goal: f64, speed: f64| reason(at, goal, speed) == Reason::WaitsForGoal;
    assert!(waits(&[(0.0, 0.0)], 1.7, 0.0));
    assert!(!waits(&[(0.0, 0.0)], 4.0, 0.0), "it is not there yet");
    assert!(waits(&[(0.0, 0.0)], 2.5, 0.0), "what is free leads away");
    assert!(!waits(&[(0.0, 0.0)], 1.7, 0.5), "who walks will be elsewhere");
    assert!(!waits(&[(0.6, 0.0)], 1.7, 0.0), "on this side there is room");
    assert!(waits(&[(0.6, 0.0), (-0.6, 0.0)], 1.7, 0.0), "two leave none between them");
    assert_eq!(reason(&[(0.0, 0.7)], 0.0, 0.0), Reason::Arrived);
}

#[test]
fn a_candidate_that_leaps_is_unreachable() {
    // 0.3 m in a step at top speed, 0.3 m of tolerance
    let candidates = fan(&[(0, 0.0, 2.1), (1, 0.0, 1.9)]);
    let s = scores(&[("cnc", &[0.0, 0.0]), ("distance", &[1.0, 2.0])]);
    let verdict = Hall::new().arbitrate(&candidates, &s, None);
    assert_eq!(verdict.decision.candidate, Some(1));
    assert_eq!(verdict.rejected[0], Some(Rejection::Unreachable { step: 0 }));
}

#[test]
fn without_anything_to_follow_the_tail_is_held_only_while_valid_near_and_free() {
    let none = CandidateSet::empty(STEPS, DT);
    let mut hall = Hall::new();
    let decide =
        |hall: &Hall, previous: Option<&Previous>| hall.arbitrate(&none, &Scores::new(0), previous).decision;
    let why = |decision: &Decision| match &decision.reason {
        Reason::Degraded { lack: Lack::NoCandidates, previous } => *previous,
        other => panic!("{other:?}"),
    };
    // Made 0.3 s ago, when the robot was where the trajectory starts; it has driven 0.24 m since.
    let p = previous(0.0, 0.0);
    hall.scene.belief.pose.x = 20.24;
    let held = decide(&hall, Some(&p));
    assert_eq!((held.action, held.candidate, why(&held)), (Action::Hold, Some(77), PreviousState::Held));
    assert_eq!(held.trajectory, p.trajectory.tail(0.3, hall.scene.belief.motion()));
    assert!((held.valid_for - 0.9).abs() < 1e-12);

    hall.scene.belief.pose.y = 20.6;
    assert!(matches!(why(&decide(&hall, Some(&p))), PreviousState::Strayed { metres } if metres > 0.59));
    hall.scene.belief.pose.y = 20.0;

    hall.add_person(22.0, 20.0);
    let blocked = decide(&hall, Some(&p));
    assert!(matches!(why(&blocked), PreviousState::Collides(c) if c.with == Obstacle::Person(0)));
    assert_eq!((blocked.action, blocked.trajectory.len(), blocked.valid_for), (Action::Stop, 0, 0.0));
    assert_eq!(why(&decide(&hall, None)), PreviousState::Absent);
    hall.scene.stamp = -0.3;
    assert_eq!(why(&decide(&hall, Some(&p))), PreviousState::Expired);
}

#[test]
fn holds_in_a_row_end_when_the_followed_trajectory_expires() {
    let none = CandidateSet::empty(STEPS, DT);
    let mut hall = Hall::new();
    let mut last = Some(previous(0.0, 0.0));
    let mut actions = Vec::new();
    for cycle in 1..=5 {
        hall.scene.stamp = 0.3 * f64::from(cycle);
        hall.scene.belief.pose.x = 20.0 + 0.8 * hall.scene.stamp;
        let decision = hall.arbitrate(&none, &Scores::new(0), last.as_ref()).decision;
        actions.push(decision.action);
        last = Previous::of(&decision, hall.scene.stamp);
    }
    // valid for 1.2 s: held at 0.3, 0.6 and 0.9 s
    assert_eq!(actions, [Action::Hold, Action::Hold, Action::Hold, Action::Stop, Action::Stop]);
}

#[test]
fn the_reason_says_what_is_missing() {
    let s = scores(&[("cnc", &[0.0; 3]), ("distance", &[f64::NAN; 3])]);
    let reason = Hall::new().arbitrate(&three(), &s, None).decision.reason;
    let lack = Lack::NotScored { term: "distance".to_owned() };
    assert_eq!(reason, Reason::Degraded { lack, previous: PreviousState::Absent });
    let mut hall = Hall::new();
    (0..12).for_each(|k| {
        let (s, c) = sin_cos(0.5 * f64::from(k));
        hall.add_person(20.0 + 1.3 * c, 20.0 + 1.3 * s);
    });
    let s = scores(&[("cnc", &[0.0; 3]), ("distance", &[1.0; 3])]);
    let reason = hall.arbitrate(&three(), &s, Some(&previous(0.0, 0.3))).decision.reason;
    let Reason::Degraded { lack: Lack::NoneFree, previous: PreviousState::Collides(collision) } = reason
    else {
        panic!("{reason:?}")
    };
    assert_eq!(collision.with, Obstacle::Person(0));
}

#[test]
fn removing_a_loser_can_change_the_winner_under_min_max_and_not_under_fixed_scales() {
    let mut hall = Hall::new();
    // The third loses either way, but while it is there it squashes the difference in cnc.
    let cnc = [0.1, 0.0, 10.0];
    let distance = [0.0, 10.0, 40.0];
    let winners = |hall: &Hall| {
        let winner = |n: usize| {
            let s = scores(&[("cnc", &cnc[..n]), ("distance", &distance[..n])]);
            hall.arbitrate(&three().pick(0..n), &s, None).decision.candidate
        };
        (winner(3), winner(2))
    };
    assert_eq!(winners(&hall), (Some(5), Some(5)));
    hall.profile.normalisation = Normalisation::MinMax;
    // With it 0.01 + 0 against 0 + 0.25; without it 1 against 1, and the tie goes to the lower id.
    assert_eq!(winners(&hall), (Some(5), Some(3)));
}

#[test]
fn persistence_keeps_the_previous_way_unless_another_is_clearly_better() {
    let mut hall = Hall::new();
    hall.scene.belief.pose.x = 20.0;
    let candidates = fan(&[(0, 1.0, 0.8), (1, -1.0, 0.8)]);
    let s = scores(&[("cnc", &[0.0, 0.0]), ("distance", &[100.0, 101.0])]);
    let p = previous(-1.0, 0.3);
    let taken = |hall: &Hall| hall.arbitrate(&candidates, &s, Some(&p)).decision.candidate;
    assert_eq!(taken(&hall), Some(0));
    // 1 m in all is 1 / 26 of a cost
    hall.profile.persistence.margin = 0.1;
    assert_eq!(taken(&hall), Some(1));
    hall.profile.persistence.margin = 0.03;
    assert_eq!(taken(&hall), Some(0));
}
