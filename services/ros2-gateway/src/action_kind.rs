//! The actions of Nav2 that the gateway serves, and Nav2's numbers for what fails.

use curionav_ros2::interface::Distribution;

use crate::config::Ros2Config;
use crate::topics::Topics;

/// An action of Nav2.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum ActionKind {
    /// To one pose, in the robot's own way.
    NavigateToPose,
    /// Through poses to the last of them, without a stop.
    NavigateThroughPoses,
    /// To waypoints, with a stop at each.
    FollowWaypoints,
    /// Along a path that a planner of Nav2 has found: what a controller of Nav2 does.
    FollowPath,
    /// A path to a pose, which is not driven.
    ComputePathToPose,
    /// A path through poses, which is not driven.
    ComputePathThroughPoses,
}

/// Why a goal fails, as far as Nav2 tells it apart.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Failure {
    /// None of the others.
    Unknown,
    /// A frame is not known, or the robot's place is not.
    Transform,
    /// A path begins outside of the map.
    StartOutside,
    /// A goal lies outside of the map.
    GoalOutside,
    /// A path begins where the robot does not fit.
    StartOccupied,
    /// The robot does not fit at the goal, or people stand there.
    GoalOccupied,
    /// There is no way.
    NoPath,
    /// There are no poses to go to.
    NoPoses,
}

impl ActionKind {
    /// Those that a robot is offered. In humble all but the first have other types.
    pub(crate) fn of(config: &Ros2Config) -> &'static [Self] {
        const ALL: [ActionKind; 6] = [
            ActionKind::NavigateToPose,
            ActionKind::NavigateThroughPoses,
            ActionKind::FollowWaypoints,
            ActionKind::FollowPath,
            ActionKind::ComputePathToPose,
            ActionKind::ComputePathThroughPoses,
        ];
        match config.distribution() {
            _ if config.is_controller() => &[ActionKind::FollowPath],
            Distribution::Humble => &ALL[..1],
            _ => &ALL,
        }
    }

    /// Its name in the configuration.
    pub(crate) fn name(self, topics: &Topics) -> &str {
        match self {
            Self::NavigateToPose => &topics.navigate_to_pose,
            Self::NavigateThroughPoses => &topics.navigate_through_poses,
            Self::FollowWaypoints => &topics.follow_waypoints,
            Self::FollowPath => &topics.follow_path,
            Self::ComputePathToPose => &topics.compute_path_to_pose,
            Self::ComputePathThroughPoses => &topics.compute_path_through_poses,
        }
    }

    /// Whether its goals move the robot: of these one is under way at a time.
    pub(crate) fn drives(self) -> bool {
        !matches!(self, Self::ComputePathToPose | Self::ComputePathThroughPoses)
    }

    /// Nav2's number for a failure. Its navigators pass on what their planner says.
    pub(crate) fn error(self, failure: Failure) -> u16 {
        let (own, planner) = match self {
            Self::NavigateToPose => (9000, 200),
            Self::NavigateThroughPoses => (9100, 300),
            Self::FollowWaypoints => return if failure == Failure::NoPoses { 602 } else { 600 },
            Self::FollowPath => return controller_error(failure),
            Self::ComputePathToPose => (200, 200),
            Self::ComputePathThroughPoses => (300, 300),
        };
        match failure {
            Failure::Unknown => own,
            Failure::Transform => own + 2,
            Failure::StartOutside => planner + 3,
            Failure::GoalOutside => planner + 4,
            Failure::StartOccupied => planner + 5,
            Failure::GoalOccupied => planner + 6,
            Failure::NoPath => planner + 8,
            Failure::NoPoses if self == Self::ComputePathThroughPoses => planner + 9,
            Failure::NoPoses => own,
        }
    }
}

/// Nav2's number for why a path is not followed.
fn controller_error(failure: Failure) -> u16 {
    match failure {
        Failure::Unknown => 100,
        Failure::Transform => 102,
        Failure::StartOutside | Failure::GoalOutside | Failure::StartOccupied | Failure::NoPoses => 103,
        Failure::GoalOccupied => 105,
        Failure::NoPath => 106,
    }
}
