//! The types of ROS 2 that a gateway for navigation needs. Fields have ROS's names, units and meanings.

mod action;
mod diagnostics;
mod geometry;
mod marker;
mod navigation;
mod people;
mod sensing;
mod transform;
mod trigger;

pub use action::{
    CancelGoalRequest, CancelGoalResponse, GetResultRequest, GetResultResponse, GetResultResponseHumble,
    GoalInfo, GoalStatus, GoalStatusArray, Navigated, NavigatedHumble, NavigatingTo, NavigationFeedback,
    NavigationFeedbackLyrical, SendGoalRequest, SendGoalResponse, TrackingErrors, Uuid,
};
pub use diagnostics::{DiagnosticArray, DiagnosticStatus, KeyValue};
pub use geometry::{
    Duration, Header, Point, Pose, PoseStamped, PoseWithCovariance, PoseWithCovarianceStamped, Quaternion,
    Time, Twist, TwistStamped, TwistWithCovariance, Vector3,
};
pub use marker::{ColorRgba, CompressedImage, Marker, MarkerArray, MeshFile, UvCoordinate};
pub use navigation::{Clock, MapMetaData, OccupancyGrid, Odometry, Path};
pub use people::{People, Person};
pub use sensing::{Bool, LaserScan, PointCloud2, PointField, Range, RangeHumble};
pub use transform::{TfMessage, Transform, TransformStamped};
pub use trigger::{TriggerRequest, TriggerResponse};
