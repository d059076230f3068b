//! The goals of actions, as `rclcpp_action` has them. Of those that move the robot at most one is under way, and a new
//! one ends it.

use std::collections::VecDeque;
use std::time::Duration;

use curionav_planning::geometry::Pose2;
use curionav_ros2::messages::{
    CancelGoalRequest, CancelGoalResponse, GoalInfo, GoalStatus, GoalStatusArray, Time, Uuid,
};
use curionav_schemas::{MissionEnd, Refusal};

use crate::action_kind::{ActionKind, Failure};
use crate::tour::{Destination, PlaceEnd, Tour};

/// Goals that are remembered, for clients that ask late.
const REMEMBERED: usize = 64;

/// How a goal fares.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Status {
    /// Accepted, not yet under way.
    Accepted = 1,
    /// Under way.
    Executing = 2,
    /// Being given up.
    Canceling = 3,
    /// Reached.
    Succeeded = 4,
    /// Given up on request.
    Canceled = 5,
    /// Failed, or replaced by another.
    Aborted = 6,
}

impl Status {
    /// As messages have it.
    pub(crate) fn code(self) -> i8 {
        self as i8
    }

    /// Whether nothing more becomes of it.
    pub(crate) fn is_end(self) -> bool {
        matches!(self, Self::Succeeded | Self::Canceled | Self::Aborted)
    }
}

/// What a goal asks for, and what has come out of it besides its status.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Task {
    /// The places to go to, and what has become of each.
    Tour(Tour),
    /// A path, once it is found, and how long that took.
    Path(Vec<Pose2>, Duration),
}

/// One goal.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Goal {
    /// As the client has named it.
    pub(crate) id: Uuid,
    /// Of which action.
    pub(crate) kind: ActionKind,
    /// What it asks for.
    pub(crate) task: Task,
    /// When it was accepted.
    pub(crate) stamp: Time,
    /// How it fares.
    pub(crate) status: Status,
    /// Why it failed, in words.
    pub(crate) why: String,
    /// The same as a number of Nav2's; 0 if it has not failed.
    pub(crate) error: u16,
}

impl Goal {
    /// A goal that is accepted now.
    pub(crate) fn new(id: Uuid, kind: ActionKind, task: Task, stamp: Time) -> Self {
        Self { id, kind, task, stamp, status: Status::Accepted, why: String::new(), error: 0 }
    }

    /// Its places, of a goal that moves the robot.
    pub(crate) fn tour(&self) -> Option<&Tour> {
        match &self.task {
            Task::Tour(tour) => Some(tour),
            Task::Path(..) => None,
        }
    }

    fn info(&self) -> GoalInfo {
        GoalInfo { goal_id: self.id, stamp: self.stamp }
    }
}

/// Why a mission has ended, if that is about its goal alone: another may still be reached.
pub(crate) fn failure_of(end: &MissionEnd) -> Option<Failure> {
    let refusal = match end {
        MissionEnd::NoWayToGoal => return Some(Failure::NoPath),
        MissionEnd::GoalOccupied => return Some(Failure::GoalOccupied),
        MissionEnd::Unprepared { reject, .. } => &reject.why,
        _ => return None,
    };
    match refusal {
        Refusal::UnreachableGoal { .. } => Some(Failure::NoPath),
        Refusal::NoRoomAtGoal { .. } => Some(Failure::GoalOccupied),
        _ => None,
    }
}

/// The goals that are known.
#[derive(Debug, Default)]
pub(crate) struct Goals {
    known: VecDeque<Goal>,
}

/// What becomes of a tour that has missed a waypoint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Missed {
    /// It goes on there.
    GoesOn(Destination),
    /// That was the last waypoint.
    Last,
}

/// What `CancelGoal` answers.
const CANCELED: i8 = 0;
const UNKNOWN: i8 = 2;
const HAS_ENDED: i8 = 3;

impl Goals {
    /// The goal of this name, if it is known.
    pub(crate) fn get(&self, id: &Uuid) -> Option<&Goal> {
        self.known.iter().find(|goal| goal.id == *id)
    }

    /// The goal that is under way.
    pub(crate) fn active(&self) -> Option<&Goal> {
        self.known.iter().rev().find(|goal| !goal.status.is_end())
    }

    /// A new goal; whether it is taken: a name can be used once.
    pub(crate) fn accept(&mut self, goal: Goal) -> bool {
        if self.get(&goal.id).is_some() {
            return false;
        }
        if self.known.len() == REMEMBERED {
            // The oldest has ended: of those that have not there are only a few, and these are the newest.
            self.known.pop_front();
        }
        self.known.push_back(goal);
        true
    }

    /// Changes how the goal under way fares; gives its name if that is a change.
    pub(crate) fn set(&mut self, status: Status, why: &str) -> Option<Uuid> {
        self.end(status, why, (!why.is_empty()).then_some(Failure::Unknown))
    }

    /// The same, with the kind of failure.
    pub(crate) fn end(&mut self, status: Status, why: &str, failure: Option<Failure>) -> Option<Uuid> {
        let goal = self.known.iter_mut().rev().find(|goal| !goal.status.is_end() && goal.status != status)?;
        goal.status = status;
        goal.error = failure.map_or(0, |failure| goal.kind.error(failure));
        why.clone_into(&mut goal.why);
        Some(goal.id)
    }

    /// The path that a goal asks for is found, or not; one that its client has given up is canceled.
    pub(crate) fn path_made(
        &mut self,
        id: &Uuid,
        outcome: Result<Vec<Pose2>, (Failure, String)>,
        took: Duration,
    ) {
        let Some(goal) = self.known.iter_mut().find(|goal| goal.id == *id && !goal.status.is_end()) else {
            return;
        };
        match outcome {
            _ if goal.status == Status::Canceling => goal.status = Status::Canceled,
            Ok(poses) => {
                goal.status = Status::Succeeded;
                goal.task = Task::Path(poses, took);
            }
            Err((failure, why)) => {
                goal.status = Status::Aborted;
                goal.error = goal.kind.error(failure);
                goal.why = why;
            }
        }
    }

    /// The place to which the goal under way leads has been reached, or passed; gives where it leads then.
    pub(crate) fn reached_place(&mut self) -> Option<Destination> {
        self.next_place(PlaceEnd::Reached)
    }

    /// The robot cannot get to the place. A tour of waypoints goes on to the next; it is over without an error if there
    /// is none, as in Nav2.
    pub(crate) fn missed_place(&mut self, failure: Failure, why: &str) -> Option<Missed> {
        let goal = self.active().filter(|goal| goal.kind == ActionKind::FollowWaypoints)?;
        if goal.status != Status::Executing {
            return None;
        }
        let error = ActionKind::NavigateToPose.error(failure);
        Some(self.next_place(PlaceEnd::Missed(error, why.to_owned())).map_or(Missed::Last, Missed::GoesOn))
    }

    fn next_place(&mut self, end: PlaceEnd) -> Option<Destination> {
        let goal = self.known.iter_mut().rev().find(|goal| goal.status == Status::Executing)?;
        match &mut goal.task {
            Task::Tour(tour) => tour.next(end),
            Task::Path(..) => None,
        }
    }

    /// Which goals of an action a request means, and the answer to it; these are then being given up.
    pub(crate) fn cancel(&mut self, kind: ActionKind, request: &CancelGoalRequest) -> CancelGoalResponse {
        let GoalInfo { goal_id, stamp } = request.goal_info;
        let any = goal_id == Uuid::default();
        let ever = stamp == Time::default();
        let mut goals_canceling = Vec::new();
        for goal in self.known.iter_mut().filter(|goal| goal.kind == kind && !goal.status.is_end()) {
            let is_meant = match (any, ever) {
                (true, true) => true,
                (true, false) => goal.stamp <= stamp,
                (false, true) => goal.id == goal_id,
                (false, false) => goal.id == goal_id || goal.stamp <= stamp,
            };
            if is_meant {
                goal.status = Status::Canceling;
                goals_canceling.push(goal.info());
            }
        }
        let return_code = match self.get(&goal_id).filter(|goal| goal.kind == kind) {
            _ if !goals_canceling.is_empty() || any => CANCELED,
            Some(_) => HAS_ENDED,
            None => UNKNOWN,
        };
        CancelGoalResponse { return_code, goals_canceling }
    }

    /// All of an action, as its topic `status` has them.
    pub(crate) fn statuses(&self, kind: ActionKind) -> GoalStatusArray {
        let of_kind = self.known.iter().filter(|goal| goal.kind == kind);
        let statuses = of_kind.map(|goal| GoalStatus { goal_info: goal.info(), status: goal.status.code() });
        GoalStatusArray { status_list: statuses.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(sec: i32) -> Time {
        Time { sec, nanosec: 0 }
    }

    const KIND: ActionKind = ActionKind::NavigateToPose;

    fn goal(id: Uuid, stamp: Time) -> Goal {
        Goal::new(id, KIND, Task::Tour(Tour::default()), stamp)
    }

    fn asked(goal_id: Uuid, stamp: Time) -> CancelGoalRequest {
        CancelGoalRequest { goal_info: GoalInfo { goal_id, stamp } }
    }

    #[test]
    fn a_goal_is_taken_once_and_ends_once() {
        let mut goals = Goals::default();
        assert!(goals.accept(goal([1; 16], at(1))) && !goals.accept(goal([1; 16], at(2))));
        assert_eq!(goals.set(Status::Executing, ""), Some([1; 16]));
        assert_eq!(goals.set(Status::Executing, ""), None);
        assert_eq!(goals.set(Status::Aborted, "another goal"), Some([1; 16]));
        assert_eq!(goals.active(), None);
        assert_eq!(goals.set(Status::Succeeded, ""), None);
        assert_eq!(
            (goals.statuses(KIND).status_list[0].status, goals.get(&[1; 16]).unwrap().why.as_str()),
            (6, "another goal")
        );
    }

    #[test]
    fn a_request_to_cancel_means_what_action_msgs_says() {
        for (request, code, canceling) in [
            (asked([0; 16], at(0)), 0, 1),
            (asked([0; 16], at(5)), 0, 1),
            (asked([0; 16], at(1)), 0, 0),
            (asked([2; 16], at(0)), 0, 1),
            (asked([1; 16], at(0)), 3, 0),
            (asked([9; 16], at(0)), 2, 0),
            (asked([9; 16], at(5)), 0, 1),
        ] {
            let mut goals = Goals::default();
            goals.accept(goal([1; 16], at(1)));
            goals.set(Status::Succeeded, "");
            goals.accept(goal([2; 16], at(5)));
            let answer = goals.cancel(KIND, &request);
            assert_eq!((answer.return_code, answer.goals_canceling.len()), (code, canceling), "{request:?}");
            assert_eq!(goals.active().unwrap().status == Status::Canceling, canceling == 1);
        }
    }

    #[test]
    fn goals_of_one_action_are_none_of_another() {
        let mut goals = Goals::default();
        goals.accept(Goal { kind: ActionKind::FollowWaypoints, ..goal([1; 16], at(1)) });
        let answer = goals.cancel(KIND, &asked([0; 16], at(0)));
        assert!(answer.goals_canceling.is_empty() && goals.statuses(KIND).status_list.is_empty());
        assert_eq!(goals.cancel(KIND, &asked([1; 16], at(0))).return_code, UNKNOWN);
    }

    #[test]
    fn a_path_that_is_given_up_while_it_is_looked_for_is_canceled() {
        for (cancels, end) in [(false, Status::Succeeded), (true, Status::Canceled)] {
            let mut goals = Goals::default();
            let kind = ActionKind::ComputePathToPose;
            goals.accept(Goal { kind, ..goal([1; 16], at(1)) });
            if cancels {
                goals.cancel(kind, &asked([1; 16], at(0)));
            }
            goals.path_made(&[1; 16], Ok(vec![Pose2::default()]), Duration::ZERO);
            assert_eq!(goals.get(&[1; 16]).unwrap().status, end);
        }
    }

    #[test]
    fn clients_that_invent_goals_fill_no_memory() {
        let mut goals = Goals::default();
        for k in 0..10 * REMEMBERED as u32 {
            let mut id = [1; 16];
            id[..4].copy_from_slice(&k.to_le_bytes());
            goals.accept(goal(id, at(1)));
            goals.set(Status::Aborted, "");
        }
        assert_eq!(goals.statuses(KIND).status_list.len(), REMEMBERED);
    }
}
