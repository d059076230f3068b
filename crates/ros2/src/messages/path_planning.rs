//! `nav2_msgs/action/ComputePathToPose` and `ComputePathThroughPoses`: a path, which is not driven.

use super::action_part::part;
use super::geometry::{Duration, PoseStamped};
use super::navigation::Path;
use super::waypoints::Goals;
use crate::limits::WAYPOINTS;

/// A pose with its texts, once for each goal.
const LIST: usize = 256 << 10;
/// A path of the greatest length, and texts.
const PATH: usize = (1 << 20) + (8 << 10);
/// What says nothing, and a name.
const SMALL: usize = 1 << 10;

message! {
    /// From where to where a path is wanted, up to kilted.
    PathTo;
    {
        /// Its end.
        goal: PoseStamped,
        /// Its beginning, if `use_start`.
        start: PoseStamped,
        /// Which of Nav2's planners is meant; empty for the only one.
        planner_id: String,
        /// Whether `start` counts; otherwise the path begins at the robot.
        use_start: bool,
    }
}
part! { PathTo = goal of "nav2_msgs/action/ComputePathToPose_SendGoal",
"RIHS01_e800806a220935f225495784663dfdd78b509335309a5127ed1112f6ce6b9dbc", at most LIST }

message! {
    /// From where to where a path is wanted, from lyrical on.
    PathToLyrical;
    {
        /// Its end.
        goal: PoseStamped,
        /// Its beginning, if `use_start`.
        start: PoseStamped,
        /// Through which poses it leads on the way.
        viapoints: Vec<PoseStamped> [WAYPOINTS],
        /// Which of Nav2's planners is meant; empty for the only one.
        planner_id: String,
        /// Whether `start` counts; otherwise the path begins at the robot.
        use_start: bool,
    }
}
part! { PathToLyrical = goal of "nav2_msgs/action/ComputePathToPose_SendGoal",
"RIHS01_17a0fab5ba4877bf9571c14fde753d26465c5a61d9dd74f027292dfdf2d309ea", at most LIST }

message! {
    /// The path that was found, or why none was.
    PathFound;
    {
        /// From start to goal.
        path: Path,
        /// How long it took to find.
        planning_time: Duration,
        /// 0 for success.
        error_code: u16,
        /// In words.
        error_msg: String,
    }
}
part! { PathFound = result of "nav2_msgs/action/ComputePathToPose_GetResult",
"RIHS01_386ab12c2f62a441596ef1140b3beca654a957eaac87e769c10de01b0e28208f", at most PATH }

message! {
    /// From where through which poses a path is wanted, from kilted on.
    PathThrough;
    {
        /// The poses, the last of which is its end.
        goals: Goals,
        /// Its beginning, if `use_start`.
        start: PoseStamped,
        /// Which of Nav2's planners is meant; empty for the only one.
        planner_id: String,
        /// Whether `start` counts; otherwise the path begins at the robot.
        use_start: bool,
    }
}
part! { PathThrough = goal of "nav2_msgs/action/ComputePathThroughPoses_SendGoal",
"RIHS01_3f2cf643185466c2bb1b22002d55d2607c4312ac3d23d6206ee430ba5a35ecec", at most LIST }

message! {
    /// From where through which poses a path is wanted, in jazzy.
    PathThroughJazzy;
    {
        /// The poses, the last of which is its end.
        goals: Vec<PoseStamped> [WAYPOINTS],
        /// Its beginning, if `use_start`.
        start: PoseStamped,
        /// Which of Nav2's planners is meant; empty for the only one.
        planner_id: String,
        /// Whether `start` counts; otherwise the path begins at the robot.
        use_start: bool,
    }
}
part! { PathThroughJazzy = goal of "nav2_msgs/action/ComputePathThroughPoses_SendGoal",
"RIHS01_6aac5f4ea44b023b4c4685ee022298a76e8a1671f27ab488adf2ac4efecfca9d", at most LIST }

message! {
    /// The path through poses that was found, or why none was, up to kilted.
    PathThroughFound;
    {
        /// From start to the last pose.
        path: Path,
        /// How long it took to find.
        planning_time: Duration,
        /// 0 for success.
        error_code: u16,
        /// In words.
        error_msg: String,
    }
}
part! { PathThroughFound = result of "nav2_msgs/action/ComputePathThroughPoses_GetResult",
"RIHS01_86b86db67d57ff222084ff1ac42e5357fdf8597973b36000e15e01ad43a9fdf7", at most PATH }

message! {
    /// The path through poses that was found, or why none was, from lyrical on.
    PathThroughFoundLyrical;
    {
        /// What earlier distributions have.
        earlier: PathThroughFound,
        /// The last pose that the path reaches; -1 if it reaches all.
        last_reached_index: i16,
    }
}
part! { PathThroughFoundLyrical = result of "nav2_msgs/action/ComputePathThroughPoses_GetResult",
"RIHS01_653d53798ee477a667585e34ed797daf86cd1fdc7e202c3fc3b23975085dbcbc", at most PATH }

message! {
    /// Feedback on a path, which says nothing: Nav2 publishes none.
    #[derive(Copy, Eq)]
    PathToFeedback;
    {
        /// Means nothing.
        structure_needs_at_least_one_member: u8,
    }
}
part! { PathToFeedback = feedback of "nav2_msgs/action/ComputePathToPose_FeedbackMessage",
"RIHS01_a086c8f040554ab5883b433bded128a1d1a732d21ca57596b7fdbe7ad2d0b64a", at most SMALL }

message! {
    /// Feedback on a path through poses, which says nothing either.
    #[derive(Copy, Eq)]
    PathThroughFeedback;
    {
        /// Means nothing.
        structure_needs_at_least_one_member: u8,
    }
}
part! { PathThroughFeedback = feedback of "nav2_msgs/action/ComputePathThroughPoses_FeedbackMessage",
"RIHS01_b04e85195fb2c41edab60868657632fa95d11e9ae69792ca2a1df9de4fbc5521", at most SMALL }
