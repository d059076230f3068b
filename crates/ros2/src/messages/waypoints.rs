//! `nav2_msgs/action/NavigateThroughPoses` and `FollowWaypoints`: several goals, one after the other.

use super::action_part::part;
use super::geometry::{Duration, Header, PoseStamped};
use crate::limits::WAYPOINTS;

/// A header, or a pose with its texts, once for each waypoint.
const LIST: usize = 256 << 10;

message! {
    /// Goals with one header, which Nav2 does not read (`nav_msgs/Goals`).
    Goals;
    {
        /// When, and in which frame.
        header: Header,
        /// In their order.
        goals: Vec<PoseStamped> [WAYPOINTS],
    }
}

message! {
    /// What has become of one waypoint (`nav2_msgs/WaypointStatus`).
    WaypointStatus;
    {
        /// 0 not yet reached, 1 reached, 2 left out, 3 failed.
        waypoint_status: u8,
        /// Its place among those of the goal.
        waypoint_index: u32,
        /// Where it is.
        waypoint_pose: PoseStamped,
        /// Why it was not reached; 0 if it was.
        error_code: u16,
        /// The same in words.
        error_msg: String,
    }
}

message! {
    /// A waypoint that was not reached, in jazzy (`nav2_msgs/MissedWaypoint`).
    MissedWaypoint;
    {
        /// Its place among those of the goal.
        index: u32,
        /// Where it is.
        goal: PoseStamped,
        /// Why it was not reached.
        error_code: u16,
    }
}

message! {
    /// Through which poses to drive to the last of them, from kilted on.
    ThroughPoses;
    {
        /// The poses.
        poses: Goals,
        /// Name of a file that says how Nav2 is to get there; empty for the default.
        behavior_tree: String,
    }
}
part! { ThroughPoses = goal of "nav2_msgs/action/NavigateThroughPoses_SendGoal",
"RIHS01_0fb14135a40c3900a9a184f95b2ed6966a0ffd298739cc9de7903ebc6dc06a25", at most LIST }

message! {
    /// Through which poses to drive to the last of them, in jazzy.
    ThroughPosesJazzy;
    {
        /// The poses.
        poses: Vec<PoseStamped> [WAYPOINTS],
        /// Name of a file that says how Nav2 is to get there; empty for the default.
        behavior_tree: String,
    }
}
part! { ThroughPosesJazzy = goal of "nav2_msgs/action/NavigateThroughPoses_SendGoal",
"RIHS01_5a590fa8e9a32b7b9c838fdf5939a2fb8858d6cfd25bdf2f2e5f0f7bbb25f52b", at most LIST }

message! {
    /// What has become of the way through poses, from kilted on.
    WentThrough;
    {
        /// 0 for success.
        error_code: u16,
        /// In words.
        error_msg: String,
        /// Of each pose.
        waypoint_statuses: Vec<WaypointStatus> [WAYPOINTS],
    }
}
part! { WentThrough = result of "nav2_msgs/action/NavigateThroughPoses_GetResult",
"RIHS01_6a44a9426cc399cf0cc59f607e0115ea0288978a82c5a4209d8616169e31dd91", at most LIST }

message! {
    /// What has become of the way through poses, in jazzy.
    #[derive(Eq)]
    WentThroughJazzy;
    {
        /// 0 for success.
        error_code: u16,
        /// In words.
        error_msg: String,
    }
}
part! { WentThroughJazzy = result of "nav2_msgs/action/NavigateThroughPoses_GetResult",
"RIHS01_fdc12773de81ce69f7eeb4366702ea757d792ab5068bc461ee3b1438e66c7b36", at most LIST }

message! {
    /// How far the way through poses is, in jazzy.
    GoingThroughJazzy;
    {
        /// Where the robot is.
        current_pose: PoseStamped,
        /// Since the goal was accepted.
        navigation_time: Duration,
        /// Until the robot will arrive.
        estimated_time_remaining: Duration,
        /// How often it had to recover.
        number_of_recoveries: i16,
        /// To the last pose, m.
        distance_remaining: f32,
        /// How many poses it has not been through.
        number_of_poses_remaining: i16,
    }
}
part! { GoingThroughJazzy = feedback of "nav2_msgs/action/NavigateThroughPoses_FeedbackMessage",
"RIHS01_073962415ad2a226b3de7245b142aeb414268a4d35ef1321ff2a484e2130e2b1", at most LIST }

message! {
    /// How far the way through poses is, in kilted.
    GoingThrough;
    {
        /// What jazzy has.
        earlier: GoingThroughJazzy,
        /// Of each pose.
        waypoint_statuses: Vec<WaypointStatus> [WAYPOINTS],
    }
}
part! { GoingThrough = feedback of "nav2_msgs/action/NavigateThroughPoses_FeedbackMessage",
"RIHS01_adebeaaa85467df1ffc48a5e398991b9ec041450573a3a11be0345f6fb13242c", at most LIST }

message! {
    /// How far the way through poses is, from lyrical on.
    GoingThroughLyrical;
    {
        /// What jazzy has.
        earlier: GoingThroughJazzy,
        /// m.
        position_tracking_error: f32,
        /// rad.
        heading_tracking_error: f32,
        /// Of each pose.
        waypoint_statuses: Vec<WaypointStatus> [WAYPOINTS],
    }
}
part! { GoingThroughLyrical = feedback of "nav2_msgs/action/NavigateThroughPoses_FeedbackMessage",
"RIHS01_635c41c7319151a8e0e39beaff75ba35b1a7d6c9cb2d85e348d309693ecf87d6", at most LIST }

message! {
    /// Which waypoints to go to, one after the other, and to stop at each.
    Waypoints;
    {
        /// How often to begin again after the last one.
        number_of_loops: u32,
        /// Which one is the first in the first round.
        goal_index: u32,
        /// The waypoints.
        poses: Vec<PoseStamped> [WAYPOINTS],
    }
}
part! { Waypoints = goal of "nav2_msgs/action/FollowWaypoints_SendGoal",
"RIHS01_20cdb80c508af436914a6da2e812289d93c6b06b4cc0670ce6530c94797bb356", at most LIST }

message! {
    /// What has become of a tour of waypoints, from kilted on.
    FollowedWaypoints;
    {
        /// Those that were not reached.
        missed_waypoints: Vec<WaypointStatus> [WAYPOINTS],
        /// 0 for success.
        error_code: u16,
        /// In words.
        error_msg: String,
    }
}
part! { FollowedWaypoints = result of "nav2_msgs/action/FollowWaypoints_GetResult",
"RIHS01_7bc8b2d136804efa78de434256aa5274b0bd8af0fa8b8abee04c6617a4293fb7", at most LIST }

message! {
    /// What has become of a tour of waypoints, in jazzy.
    FollowedWaypointsJazzy;
    {
        /// Those that were not reached.
        missed_waypoints: Vec<MissedWaypoint> [WAYPOINTS],
        /// 0 for success.
        error_code: u16,
        /// In words.
        error_msg: String,
    }
}
part! { FollowedWaypointsJazzy = result of "nav2_msgs/action/FollowWaypoints_GetResult",
"RIHS01_feb0bffee2e1c19bae16974eb939974eab100c13f941daf6402d605e4b3203e4", at most LIST }

message! {
    /// How far a tour of waypoints is.
    #[derive(Copy, Eq)]
    FollowingWaypoints;
    {
        /// Which waypoint the robot goes to.
        current_waypoint: u32,
    }
}
part! { FollowingWaypoints = feedback of "nav2_msgs/action/FollowWaypoints_FeedbackMessage",
"RIHS01_467071c0ede294cafe6be7251e6e85716a6e19b8ed46db18952ac0c05597abcf", at most LIST }
