//! Actions in general, and `nav2_msgs/action/NavigateToPose`.

use super::geometry::{Duration, PoseStamped, Time};
use crate::interface::Interface;
use crate::limits::GOALS;

/// Name of a goal, which its client invents.
pub type Uuid = [u8; 16];

const SEND_GOAL: Interface = Interface::new(
    "nav2_msgs/action/NavigateToPose_SendGoal",
    "RIHS01_a4fcb3bee1bf32e21a0e541a943b221aa0826996e2c98f079b47022b256f48b5",
);
const GET_RESULT: Interface = Interface::new(
    "nav2_msgs/action/NavigateToPose_GetResult",
    "RIHS01_c407920357d566771e8882b4ef4d1f1a84ee922d609920ccd57faa6d6e391dc5",
);
const CANCEL_GOAL: Interface = Interface::new(
    "action_msgs/srv/CancelGoal",
    "RIHS01_573d8b0a534451d7bc2ac8c5ffde8ac14b8593b7001175d0cd6516dcbeb8689a",
);
/// Requests and results, with the longest texts.
const SMALL: usize = 8 << 10;
/// One entry for each goal that is known.
const LIST: usize = 64 << 10;

message! {
    /// A goal and since when there is one.
    #[derive(Copy, Eq)]
    GoalInfo;
    {
        /// Its name; all zero stands for every goal.
        goal_id: Uuid,
        /// When it was accepted.
        stamp: Time,
    }
}

message! {
    /// How one goal fares.
    #[derive(Copy, Eq)]
    GoalStatus;
    {
        /// The goal.
        goal_info: GoalInfo,
        /// 1 accepted, 2 executing, 3 canceling, 4 succeeded, 5 canceled, 6 aborted.
        status: i8,
    }
}

message! {
    /// How all goals of one action fare.
    #[derive(Eq)]
    GoalStatusArray = "action_msgs/msg/GoalStatusArray" of Interface::new(
        "action_msgs/msg/GoalStatusArray",
        "RIHS01_6c1684b00f177d37438febe6e709fc4e2b0d4248dca4854946f9ed8b30cda83e",
    ), at most LIST;
    {
        /// One per goal that the server still remembers.
        status_list: Vec<GoalStatus> [GOALS],
    }
}

message! {
    /// Asks to give up a goal. A name of zeros and a stamp of zero mean all goals, a stamp alone all goals up to then.
    #[derive(Copy, Eq)]
    CancelGoalRequest = "action_msgs/srv/CancelGoal_Request" of CANCEL_GOAL, at most SMALL;
    {
        /// The goal.
        goal_info: GoalInfo,
    }
}

message! {
    /// Which goals are given up.
    #[derive(Eq)]
    CancelGoalResponse = "action_msgs/srv/CancelGoal_Response" of CANCEL_GOAL, at most LIST;
    {
        /// 0 if any is, 1 refused, 2 there is no such goal, 3 it has ended.
        return_code: i8,
        /// The goals that will be cancelled.
        goals_canceling: Vec<GoalInfo> [GOALS],
    }
}

message! {
    /// Where to go.
    NavigatingTo;
    {
        /// The goal.
        pose: PoseStamped,
        /// Name of a file that says how Nav2 is to get there; empty for the default.
        behavior_tree: String,
    }
}

message! {
    /// Asks to navigate.
    SendGoalRequest = "nav2_msgs/action/NavigateToPose_SendGoal_Request" of SEND_GOAL, at most SMALL;
    {
        /// Chosen by the client; unique.
        goal_id: Uuid,
        /// Where to go.
        goal: NavigatingTo,
    }
}

message! {
    /// Whether a goal is accepted.
    #[derive(Copy, Eq)]
    SendGoalResponse = "nav2_msgs/action/NavigateToPose_SendGoal_Response" of SEND_GOAL, at most SMALL;
    {
        /// Whether it is.
        accepted: bool,
        /// Since when.
        stamp: Time,
    }
}

message! {
    /// Asks what has become of a goal; it is answered when the goal has ended.
    #[derive(Copy, Eq)]
    GetResultRequest = "nav2_msgs/action/NavigateToPose_GetResult_Request" of GET_RESULT, at most SMALL;
    {
        /// The goal.
        goal_id: Uuid,
    }
}

message! {
    /// Why navigation has failed, if it has.
    #[derive(Eq)]
    Navigated;
    {
        /// 0 for success.
        error_code: u16,
        /// In words.
        error_msg: String,
    }
}

message! {
    /// What has become of a goal, from jazzy on.
    #[derive(Eq)]
    GetResultResponse = "nav2_msgs/action/NavigateToPose_GetResult_Response" of GET_RESULT, at most SMALL;
    {
        /// As of [`GoalStatus`]; 0 for a goal that is not known.
        status: i8,
        /// Why it has failed.
        result: Navigated,
    }
}

message! {
    /// The empty message, which ROS fills with one byte.
    #[derive(Copy, Eq)]
    NavigatedHumble;
    {
        /// Means nothing.
        structure_needs_at_least_one_member: u8,
    }
}

message! {
    /// What has become of a goal, in humble.
    #[derive(Copy, Eq)]
    GetResultResponseHumble = "nav2_msgs/action/NavigateToPose_GetResult_Response" of GET_RESULT, at most SMALL;
    {
        /// As of [`GoalStatus`]; 0 for a goal that is not known.
        status: i8,
        /// Nothing.
        result: NavigatedHumble,
    }
}

message! {
    /// How a navigation fares, up to kilted.
    NavigationFeedback = "nav2_msgs/action/NavigateToPose_FeedbackMessage" of Interface::new(
        "nav2_msgs/action/NavigateToPose_FeedbackMessage",
        "RIHS01_9d1f6fa2eb975ce733b419ac2e97b134d8ff92b6478b6559feed9a50bdfd82b3",
    ), at most SMALL;
    {
        /// The goal.
        goal_id: Uuid,
        /// Where the robot is.
        current_pose: PoseStamped,
        /// Since the goal was accepted.
        navigation_time: Duration,
        /// Until the robot will arrive.
        estimated_time_remaining: Duration,
        /// How often it had to recover.
        number_of_recoveries: i16,
        /// To the goal, m.
        distance_remaining: f32,
    }
}

message! {
    /// How far the robot is off its path.
    #[derive(Copy)]
    TrackingErrors;
    {
        /// m.
        position: f32,
        /// rad.
        heading: f32,
    }
}

message! {
    /// How a navigation fares, from lyrical on.
    NavigationFeedbackLyrical = "nav2_msgs/action/NavigateToPose_FeedbackMessage" of Interface::new(
        "nav2_msgs/action/NavigateToPose_FeedbackMessage",
        "RIHS01_2c1b4ec1a0e3a53c9aa326aabe717670eeef0ff3d4c3351ff940613b2011728a",
    ), at most SMALL;
    {
        /// What earlier distributions have.
        earlier: NavigationFeedback,
        /// What is new.
        tracking: TrackingErrors,
    }
}
