//! What tests need: every type by its name, values that are random, and values as JSON.

use serde::Serialize;

use crate::cdr::CdrError;
use crate::interface::Interface;
use crate::message::Message;
use crate::messages as ros;
pub use crate::random::{Random, Rng};

/// Why a payload cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum ShowError {
    /// It is no such message.
    #[error(transparent)]
    Cdr(#[from] CdrError),
    /// JSON cannot say it.
    #[error(transparent)]
    Json(#[from] serde_json::Error),
}

/// What is decoded and encoded again, and the value as JSON, in which a number that is not finite is null.
pub type Shown = (Vec<u8>, serde_json::Value);

/// A type by its name.
#[derive(Debug, Clone, Copy)]
pub struct Type {
    /// In ROS; from a version on of distribution that differs, with that distribution after a colon.
    pub name: &'static str,
    /// What stands in keys.
    pub interface: Interface,
    /// Bytes of a payload at most.
    pub max_bytes: usize,
    /// Decodes a payload and encodes it again.
    pub recode: fn(&[u8]) -> Result<Vec<u8>, CdrError>,
    /// As `recode`, and the value as JSON.
    pub show: fn(&[u8]) -> Result<Shown, ShowError>,
    /// A random value, encoded.
    pub random: fn(&mut Rng) -> Result<Vec<u8>, CdrError>,
}

const fn entry<M: Message + Random + Serialize>(name: &'static str) -> Type {
    Type {
        name,
        interface: M::INTERFACE,
        max_bytes: M::MAX_BYTES,
        recode: |payload| M::decode(payload)?.encode(),
        show: |payload| {
            let value = M::decode(payload)?;
            Ok((value.encode()?, serde_json::to_value(&value)?))
        },
        random: |rng| M::random(rng).encode(),
    }
}

const fn named<M: Message + Random + Serialize>() -> Type {
    entry::<M>(M::NAME)
}

/// Every type that is sent by itself.
pub const TYPES: &[Type] = &[
    named::<ros::LaserScan>(),
    named::<ros::PointCloud2>(),
    named::<ros::Range>(),
    entry::<ros::RangeHumble>("sensor_msgs/msg/Range:humble"),
    named::<ros::Bool>(),
    named::<ros::Odometry>(),
    named::<ros::OccupancyGrid>(),
    named::<ros::OccupancyGridUpdate>(),
    named::<ros::Path>(),
    named::<ros::Twist>(),
    named::<ros::TwistStamped>(),
    named::<ros::PoseStamped>(),
    named::<ros::PoseWithCovarianceStamped>(),
    named::<ros::TfMessage>(),
    named::<ros::MarkerArray>(),
    named::<ros::Clock>(),
    named::<ros::People>(),
    named::<ros::DiagnosticArray>(),
    named::<ros::GoalStatusArray>(),
    named::<ros::CancelGoalRequest>(),
    named::<ros::CancelGoalResponse>(),
    named::<ros::SendGoalRequest>(),
    named::<ros::SendGoalResponse>(),
    named::<ros::GetResultRequest>(),
    named::<ros::GetResultResponse>(),
    entry::<ros::GetResultResponse<ros::Nothing>>(
        "nav2_msgs/action/NavigateToPose_GetResult_Response:humble",
    ),
    named::<ros::TriggerRequest>(),
    named::<ros::TriggerResponse>(),
    named::<ros::NavigationFeedback>(),
    entry::<ros::NavigationFeedbackLyrical>("nav2_msgs/action/NavigateToPose_FeedbackMessage:lyrical"),
    named::<ros::SendGoalRequest<ros::ThroughPoses>>(),
    entry::<ros::SendGoalRequest<ros::ThroughPosesJazzy>>(
        "nav2_msgs/action/NavigateThroughPoses_SendGoal_Request:jazzy",
    ),
    named::<ros::GetResultResponse<ros::WentThrough>>(),
    entry::<ros::GetResultResponse<ros::WentThroughJazzy>>(
        "nav2_msgs/action/NavigateThroughPoses_GetResult_Response:jazzy",
    ),
    named::<ros::FeedbackMessage<ros::GoingThrough>>(),
    entry::<ros::FeedbackMessage<ros::GoingThroughJazzy>>(
        "nav2_msgs/action/NavigateThroughPoses_FeedbackMessage:jazzy",
    ),
    entry::<ros::FeedbackMessage<ros::GoingThroughLyrical>>(
        "nav2_msgs/action/NavigateThroughPoses_FeedbackMessage:lyrical",
    ),
    named::<ros::SendGoalRequest<ros::Waypoints>>(),
    named::<ros::GetResultResponse<ros::FollowedWaypoints>>(),
    entry::<ros::GetResultResponse<ros::FollowedWaypointsJazzy>>(
        "nav2_msgs/action/FollowWaypoints_GetResult_Response:jazzy",
    ),
    named::<ros::FeedbackMessage<ros::FollowingWaypoints>>(),
    named::<ros::SendGoalRequest<ros::PathTo>>(),
    entry::<ros::SendGoalRequest<ros::PathToLyrical>>(
        "nav2_msgs/action/ComputePathToPose_SendGoal_Request:lyrical",
    ),
    named::<ros::GetResultResponse<ros::PathFound>>(),
    named::<ros::FeedbackMessage<ros::PathToFeedback>>(),
    named::<ros::SendGoalRequest<ros::PathThrough>>(),
    entry::<ros::SendGoalRequest<ros::PathThroughJazzy>>(
        "nav2_msgs/action/ComputePathThroughPoses_SendGoal_Request:jazzy",
    ),
    named::<ros::GetResultResponse<ros::PathThroughFound>>(),
    entry::<ros::GetResultResponse<ros::PathThroughFoundLyrical>>(
        "nav2_msgs/action/ComputePathThroughPoses_GetResult_Response:lyrical",
    ),
    named::<ros::FeedbackMessage<ros::PathThroughFeedback>>(),
    named::<ros::SendGoalRequest<ros::PathToFollow>>(),
    entry::<ros::SendGoalRequest<ros::PathToFollowLyrical>>(
        "nav2_msgs/action/FollowPath_SendGoal_Request:lyrical",
    ),
    named::<ros::GetResultResponse<ros::FollowedPath>>(),
    named::<ros::FeedbackMessage<ros::FollowingPath>>(),
    entry::<ros::FeedbackMessage<ros::FollowingPathLyrical>>(
        "nav2_msgs/action/FollowPath_FeedbackMessage:lyrical",
    ),
    named::<ros::SpeedLimit>(),
    named::<ros::GetStateRequest>(),
    named::<ros::GetStateResponse>(),
    named::<ros::ListParametersRequest>(),
    named::<ros::ListParametersResponse>(),
    named::<ros::GetParametersRequest>(),
    named::<ros::GetParametersResponse>(),
    named::<ros::GetParameterTypesRequest>(),
    named::<ros::GetParameterTypesResponse>(),
    named::<ros::DescribeParametersRequest>(),
    named::<ros::DescribeParametersResponse>(),
    named::<ros::SetParametersRequest>(),
    named::<ros::SetParametersResponse>(),
    named::<ros::SetParametersAtomicallyRequest>(),
    named::<ros::SetParametersAtomicallyResponse>(),
];

/// The type of this name.
pub fn type_of(name: &str) -> Option<&'static Type> {
    TYPES.iter().find(|of| of.name == name)
}
