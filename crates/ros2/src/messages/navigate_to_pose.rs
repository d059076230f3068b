//! `nav2_msgs/action/NavigateToPose`: one goal, and the robot's own way to it.

use super::action_part::{Nothing, Uuid, part};
use super::geometry::{Duration, PoseStamped};
use crate::interface::Interface;

/// Requests and results, with the longest texts.
const SMALL: usize = 8 << 10;

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
part! { NavigatingTo = goal of "nav2_msgs/action/NavigateToPose_SendGoal",
"RIHS01_a4fcb3bee1bf32e21a0e541a943b221aa0826996e2c98f079b47022b256f48b5", at most SMALL }

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
part! { Navigated = result of "nav2_msgs/action/NavigateToPose_GetResult",
"RIHS01_c407920357d566771e8882b4ef4d1f1a84ee922d609920ccd57faa6d6e391dc5", at most SMALL }

// The result of humble.
part! { Nothing = result of "nav2_msgs/action/NavigateToPose_GetResult",
"RIHS01_c407920357d566771e8882b4ef4d1f1a84ee922d609920ccd57faa6d6e391dc5", at most SMALL }

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
