//! The types of ROS 2 that a gateway for navigation needs. Fields have ROS's names, units and meanings.

mod action;
mod action_part;
mod diagnostics;
mod geometry;
mod lifecycle;
mod marker;
mod navigate_to_pose;
mod navigation;
mod parameters;
mod path_following;
mod path_planning;
mod people;
mod sensing;
mod transform;
mod trigger;
mod waypoints;

pub use action::{
    CancelGoalRequest, CancelGoalResponse, FeedbackMessage, GetResultRequest, GetResultResponse, GoalInfo,
    GoalStatus, GoalStatusArray, SendGoalRequest, SendGoalResponse,
};
pub use action_part::{Nothing, Part, Uuid};
pub use diagnostics::{DiagnosticArray, DiagnosticStatus, KeyValue};
pub use geometry::{
    Duration, Header, Point, Pose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion,
    Time, Twist, TwistStamped, TwistWithCovariance, Vector3,
};
pub use lifecycle::{GetStateRequest, GetStateResponse, LifecycleState};
pub use marker::{ColorRgba, CompressedImage, Marker, MarkerArray, MeshFile, UvCoordinate};
pub use navigate_to_pose::{
    Navigated, NavigatingTo, NavigationFeedback, NavigationFeedbackLyrical, TrackingErrors,
};
pub use navigation::{Clock, MapMetaData, OccupancyGrid, OccupancyGridUpdate, Odometry, Path};
pub use parameters::{
    AtMostOne, DescribeParametersRequest, DescribeParametersResponse, FloatingPointRange,
    GetParameterTypesRequest, GetParameterTypesResponse, GetParametersRequest, GetParametersResponse,
    IntegerRange, ListParametersRequest, ListParametersResponse, ListParametersResult, Parameter,
    ParameterDescriptor, ParameterValue, SetParametersAtomicallyRequest, SetParametersAtomicallyResponse,
    SetParametersRequest, SetParametersResponse, SetParametersResult,
};
pub use path_following::{
    FollowedPath, FollowingPath, FollowingPathLyrical, PathToFollow, PathToFollowLyrical, SpeedLimit,
};
pub use path_planning::{
    PathFound, PathThrough, PathThroughFeedback, PathThroughFound, PathThroughFoundLyrical, PathThroughJazzy,
    PathTo, PathToFeedback, PathToLyrical,
};
pub use people::{People, Person};
pub use sensing::{Bool, LaserScan, PointCloud2, PointField, Range, RangeHumble};
pub use transform::{TfMessage, Transform, TransformStamped};
pub use trigger::{TriggerRequest, TriggerResponse};
pub use waypoints::{
    FollowedWaypoints, FollowedWaypointsJazzy, FollowingWaypoints, Goals, GoingThrough, GoingThroughJazzy,
    GoingThroughLyrical, MissedWaypoint, ThroughPoses, ThroughPosesJazzy, WaypointStatus, Waypoints,
    WentThrough, WentThroughJazzy,
};
