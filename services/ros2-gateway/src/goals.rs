//! The goals of the action, as `rclcpp_action` has them: at most one is under way, and a new one ends it.

use std::collections::VecDeque;

use curionav_ros2::messages::{
    CancelGoalRequest, CancelGoalResponse, GoalInfo, GoalStatus, GoalStatusArray, Time, Uuid,
};
use curionav_schemas::{MissionEnd, Refusal};

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

/// One goal.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Goal {
    /// As the client has named it.
    pub(crate) id: Uuid,
    /// When it was accepted.
    pub(crate) stamp: Time,
    /// How it fares.
    pub(crate) status: Status,
    /// Why it failed, in words.
    pub(crate) why: String,
    /// The same as a number of Nav2's; 0 if it has not failed.
    pub(crate) error: u16,
}

/// Nav2's number for failures that are none of its own kinds.
const ANY_FAILURE: u16 = 9000;

impl Goal {
    fn info(&self) -> GoalInfo {
        GoalInfo { goal_id: self.id, stamp: self.stamp }
    }
}

/// Nav2's numbers in `ComputePathToPose`, which its navigator passes on: something stands on the goal, or there is no
/// way.
const GOAL_OCCUPIED: u16 = 206;
const NO_VALID_PATH: u16 = 208;

/// The number that Nav2 has for the end of a mission, if it has one of its own.
pub(crate) fn error_of(end: &MissionEnd) -> Option<u16> {
    let refusal = match end {
        MissionEnd::NoWayToGoal => return Some(NO_VALID_PATH),
        MissionEnd::GoalOccupied => return Some(GOAL_OCCUPIED),
        MissionEnd::Unprepared { reject, .. } => &reject.why,
        _ => return None,
    };
    match refusal {
        Refusal::UnreachableGoal { .. } => Some(NO_VALID_PATH),
        Refusal::NoRoomAtGoal { .. } => Some(GOAL_OCCUPIED),
        _ => None,
    }
}

/// The goals that are known.
#[derive(Debug, Default)]
pub(crate) struct Goals {
    known: VecDeque<Goal>,
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
    pub(crate) fn accept(&mut self, id: Uuid, stamp: Time) -> bool {
        if self.get(&id).is_some() {
            return false;
        }
        if self.known.len() == REMEMBERED {
            // The oldest has ended: at most one has not, and that is the newest.
            self.known.pop_front();
        }
        self.known.push_back(Goal { id, stamp, status: Status::Accepted, why: String::new(), error: 0 });
        true
    }

    /// Changes how the goal under way fares; gives its name if that is a change.
    pub(crate) fn set(&mut self, status: Status, why: &str) -> Option<Uuid> {
        self.end(status, why, if why.is_empty() { 0 } else { ANY_FAILURE })
    }

    /// The same, with the number that Nav2 has for the failure.
    pub(crate) fn end(&mut self, status: Status, why: &str, error: u16) -> Option<Uuid> {
        let goal = self.known.iter_mut().rev().find(|goal| !goal.status.is_end() && goal.status != status)?;
        goal.status = status;
        goal.error = error;
        why.clone_into(&mut goal.why);
        Some(goal.id)
    }

    /// Which goals a request means, and the answer to it; the one under way is then being given up.
    pub(crate) fn cancel(&mut self, request: &CancelGoalRequest) -> CancelGoalResponse {
        let GoalInfo { goal_id, stamp } = request.goal_info;
        let any = goal_id == Uuid::default();
        let ever = stamp == Time::default();
        let mut goals_canceling = Vec::new();
        for goal in self.known.iter_mut().filter(|goal| !goal.status.is_end()) {
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
        let return_code = match self.get(&goal_id) {
            _ if !goals_canceling.is_empty() || any => CANCELED,
            Some(_) => HAS_ENDED,
            None => UNKNOWN,
        };
        CancelGoalResponse { return_code, goals_canceling }
    }

    /// All of them, as the topic `status` has them.
    pub(crate) fn statuses(&self) -> GoalStatusArray {
        let statuses =
            self.known.iter().map(|goal| GoalStatus { goal_info: goal.info(), status: goal.status.code() });
        GoalStatusArray { status_list: statuses.collect() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(sec: i32) -> Time {
        Time { sec, nanosec: 0 }
    }

    fn asked(goal_id: Uuid, stamp: Time) -> CancelGoalRequest {
        CancelGoalRequest { goal_info: GoalInfo { goal_id, stamp } }
    }

    #[test]
    fn a_goal_is_taken_once_and_ends_once() {
        let mut goals = Goals::default();
        assert!(goals.accept([1; 16], at(1)) && !goals.accept([1; 16], at(2)));
        assert_eq!(goals.set(Status::Executing, ""), Some([1; 16]));
        assert_eq!(goals.set(Status::Executing, ""), None);
        assert_eq!(goals.set(Status::Aborted, "another goal"), Some([1; 16]));
        assert_eq!(goals.active(), None);
        assert_eq!(goals.set(Status::Succeeded, ""), None);
        assert_eq!(
            (goals.statuses().status_list[0].status, goals.get(&[1; 16]).unwrap().why.as_str()),
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
            goals.accept([1; 16], at(1));
            goals.set(Status::Succeeded, "");
            goals.accept([2; 16], at(5));
            let answer = goals.cancel(&request);
            assert_eq!((answer.return_code, answer.goals_canceling.len()), (code, canceling), "{request:?}");
            assert_eq!(goals.active().unwrap().status == Status::Canceling, canceling == 1);
        }
    }

    #[test]
    fn clients_that_invent_goals_fill_no_memory() {
        let mut goals = Goals::default();
        for k in 0..10 * REMEMBERED as u32 {
            let mut id = [1; 16];
            id[..4].copy_from_slice(&k.to_le_bytes());
            goals.accept(id, at(1));
            goals.set(Status::Aborted, "");
        }
        assert_eq!(goals.statuses().status_list.len(), REMEMBERED);
    }
}
