//! `nav2_msgs/action/FollowPath`, which is what a controller of Nav2 does, and `nav2_msgs/msg/SpeedLimit`.

use super::action_part::{Nothing, part};
use super::geometry::{Header, PoseStamped};
use super::navigation::Path;
use crate::interface::Interface;

/// A path of the greatest length, and texts.
const PATH: usize = (1 << 20) + (8 << 10);
/// Results and feedback, with the longest texts.
const SMALL: usize = 8 << 10;

message! {
    /// Which path to follow, up to kilted.
    PathToFollow;
    {
        /// From the robot to the goal.
        path: Path,
        /// Which of Nav2's controllers is meant; empty for the only one.
        controller_id: String,
        /// Which of its plugins says that the goal is reached.
        goal_checker_id: String,
        /// Which of its plugins says that the robot does not get on.
        progress_checker_id: String,
    }
}
part! { PathToFollow = goal of "nav2_msgs/action/FollowPath_SendGoal",
"RIHS01_5b662aee1159e1d7e7b5f8fef21f556b8bc67c818c730a68e18bb29b85f66946", at most PATH }

message! {
    /// Which path to follow, from lyrical on.
    PathToFollowLyrical;
    {
        /// What earlier distributions have.
        earlier: PathToFollow,
        /// Which of Nav2's plugins cuts the path.
        path_handler_id: String,
    }
}
part! { PathToFollowLyrical = goal of "nav2_msgs/action/FollowPath_SendGoal",
"RIHS01_0c091793c90a67349df3445771d5d30005daea785137bd6e6bf5d96ea53fb721", at most PATH }

message! {
    /// What has become of following a path.
    #[derive(Eq)]
    FollowedPath;
    {
        /// Says nothing (`std_msgs/Empty`).
        result: Nothing,
        /// 0 for success.
        error_code: u16,
        /// In words.
        error_msg: String,
    }
}
part! { FollowedPath = result of "nav2_msgs/action/FollowPath_GetResult",
"RIHS01_8ab4c588c878f0e997316ec559f172bb56fc210b484c2f6b280d391d3bd6890f", at most SMALL }

message! {
    /// How far a path is followed, up to kilted.
    #[derive(Copy)]
    FollowingPath;
    {
        /// Along the path, m.
        distance_to_goal: f32,
        /// m/s.
        speed: f32,
    }
}
part! { FollowingPath = feedback of "nav2_msgs/action/FollowPath_FeedbackMessage",
"RIHS01_3f4008700ba56ac4c82b01ef2b7fdd3fc18dc194399c48e5c43ebf8008b891d5", at most SMALL }

message! {
    /// How far a path is followed, from lyrical on (`nav2_msgs/TrackingFeedback`).
    FollowingPathLyrical;
    {
        /// When, and in which frame.
        header: Header,
        /// How far the robot is to the left of the path, m.
        position_tracking_error: f32,
        /// How far it is turned to the right of the path, rad.
        heading_tracking_error: f32,
        /// Which pose of the path is nearest.
        current_path_index: u32,
        /// Where the robot is.
        robot_pose: PoseStamped,
        /// Along the path, m.
        distance_to_goal: f32,
        /// m/s.
        speed: f32,
        /// Along the path, m.
        remaining_path_length: f32,
    }
}
part! { FollowingPathLyrical = feedback of "nav2_msgs/action/FollowPath_FeedbackMessage",
"RIHS01_98d6d4ee571bfacbae2578e2adabd22fee50ea15b44cda31b65c3390964cd013", at most SMALL }

message! {
    /// How fast the robot may drive.
    SpeedLimit = "nav2_msgs/msg/SpeedLimit" of Interface::new(
        "nav2_msgs/msg/SpeedLimit",
        "RIHS01_83d8e4e842559f4d9a988b19d31b162216ec738536389f98438d1a166f91845a",
    ), at most SMALL;
    {
        /// When.
        header: Header,
        /// Whether the limit is in per cent of the robot's greatest speed; otherwise it is in m/s.
        percentage: bool,
        /// The limit; 0 if there is none.
        speed_limit: f64,
    }
}
