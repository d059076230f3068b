//! What the gateway says of goals: how they fare, how far they are, and what has become of them.

use curionav_planning::geometry::Pose2;
use curionav_ros2::interface::Distribution;
use curionav_ros2::limits::TEXT;
use curionav_ros2::messages::{self as ros, FeedbackMessage};
use curionav_ros2::qos::Qos;

use crate::action_kind::ActionKind;
use crate::config::{Frames, Ros2Config};
use crate::drawing::{self, header};
use crate::given_path::Beside;
use crate::goals::{Goal, Goals, Task};
use crate::node::{Node, Outlet, Request};
use crate::tour::{Place, PlaceEnd, Tour};

/// How far the goal under way is.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Progress {
    /// Where the robot believes to be.
    pub(crate) at: Pose2,
    /// To the end, metres.
    pub(crate) distance: f64,
    /// How long that will take, seconds.
    pub(crate) remaining: f64,
    /// How fast it is, m/s.
    pub(crate) speed: f64,
    /// Where it is beside the path that it follows, if one is given.
    pub(crate) beside: Option<Beside>,
    /// The robot's time.
    pub(crate) now: ros::Time,
}

enum Feedback {
    ToPose(Outlet<ros::NavigationFeedback>),
    ToPoseLyrical(Outlet<ros::NavigationFeedbackLyrical>),
    ThroughJazzy(Outlet<FeedbackMessage<ros::GoingThroughJazzy>>),
    Through(Outlet<FeedbackMessage<ros::GoingThrough>>),
    ThroughLyrical(Outlet<FeedbackMessage<ros::GoingThroughLyrical>>),
    Waypoints(Outlet<FeedbackMessage<ros::FollowingWaypoints>>),
    Path(Outlet<FeedbackMessage<ros::FollowingPath>>),
    PathLyrical(Outlet<FeedbackMessage<ros::FollowingPathLyrical>>),
    /// Nav2 says nothing on these, but a client looks whether there is such a topic.
    PathTo(
        #[expect(dead_code, reason = "it is there to be found")] Outlet<FeedbackMessage<ros::PathToFeedback>>,
    ),
    PathThrough(
        #[expect(dead_code, reason = "it is there to be found")]
        Outlet<FeedbackMessage<ros::PathThroughFeedback>>,
    ),
}

impl Feedback {
    fn new(node: &Node, kind: ActionKind, topic: &str, distribution: Distribution) -> anyhow::Result<Self> {
        use Distribution::{Jazzy, Lyrical};
        Ok(match (kind, distribution) {
            (ActionKind::NavigateToPose, Lyrical) => Self::ToPoseLyrical(node.outlet(topic, Qos::DEFAULT)?),
            (ActionKind::NavigateToPose, _) => Self::ToPose(node.outlet(topic, Qos::DEFAULT)?),
            (ActionKind::NavigateThroughPoses, Jazzy) => {
                Self::ThroughJazzy(node.outlet(topic, Qos::DEFAULT)?)
            }
            (ActionKind::NavigateThroughPoses, Lyrical) => {
                Self::ThroughLyrical(node.outlet(topic, Qos::DEFAULT)?)
            }
            (ActionKind::NavigateThroughPoses, _) => Self::Through(node.outlet(topic, Qos::DEFAULT)?),
            (ActionKind::FollowWaypoints, _) => Self::Waypoints(node.outlet(topic, Qos::DEFAULT)?),
            (ActionKind::FollowPath, Lyrical) => Self::PathLyrical(node.outlet(topic, Qos::DEFAULT)?),
            (ActionKind::FollowPath, _) => Self::Path(node.outlet(topic, Qos::DEFAULT)?),
            (ActionKind::ComputePathToPose, _) => Self::PathTo(node.outlet(topic, Qos::DEFAULT)?),
            (ActionKind::ComputePathThroughPoses, _) => Self::PathThrough(node.outlet(topic, Qos::DEFAULT)?),
        })
    }
}

/// The topics of one action.
struct OfAction {
    kind: ActionKind,
    feedback: Feedback,
    status: Outlet<ros::GoalStatusArray>,
}

/// The topics of all actions, and their results.
pub(crate) struct ActionPublishers {
    distribution: Distribution,
    frames: Frames,
    actions: Vec<OfAction>,
}

impl ActionPublishers {
    /// Declares the topics.
    ///
    /// # Errors
    /// If one cannot be declared.
    pub(crate) fn new(node: &Node, config: &Ros2Config) -> anyhow::Result<Self> {
        let distribution = config.distribution();
        let mut actions = Vec::new();
        for kind in ActionKind::of(config).iter().copied() {
            let name = kind.name(&config.topics);
            let feedback = Feedback::new(node, kind, &format!("{name}/_action/feedback"), distribution)?;
            let status = node.outlet(&format!("{name}/_action/status"), Qos::LATCHED)?;
            actions.push(OfAction { kind, feedback, status });
        }
        Ok(Self { distribution, frames: config.frames.clone(), actions })
    }

    /// How the goals fare: of all actions that move the robot, or of all that look for a path.
    pub(crate) fn status(&self, goals: &Goals, drives: bool) {
        for action in self.actions.iter().filter(|action| action.kind.drives() == drives) {
            action.status.put(&goals.statuses(action.kind));
        }
    }

    /// How far the goal under way is.
    pub(crate) fn feedback(&self, goal: &Goal, progress: &Progress) {
        let Some(action) = self.actions.iter().find(|action| action.kind == goal.kind) else { return };
        let Some(tour) = goal.tour() else { return };
        let id = goal.id;
        match &action.feedback {
            Feedback::ToPose(outlet) => outlet.put(&self.to_pose(goal, progress)),
            Feedback::ToPoseLyrical(outlet) => outlet.put(&ros::NavigationFeedbackLyrical {
                earlier: self.to_pose(goal, progress),
                tracking: ros::TrackingErrors::default(),
            }),
            Feedback::ThroughJazzy(outlet) => {
                outlet.put(&FeedbackMessage { goal_id: id, feedback: self.through(goal, tour, progress) });
            }
            Feedback::Through(outlet) => {
                let earlier = self.through(goal, tour, progress);
                let feedback = ros::GoingThrough { earlier, waypoint_statuses: statuses(tour) };
                outlet.put(&FeedbackMessage { goal_id: id, feedback });
            }
            Feedback::ThroughLyrical(outlet) => {
                let feedback = ros::GoingThroughLyrical {
                    earlier: self.through(goal, tour, progress),
                    waypoint_statuses: statuses(tour),
                    ..Default::default()
                };
                outlet.put(&FeedbackMessage { goal_id: id, feedback });
            }
            Feedback::Waypoints(outlet) => {
                let feedback = ros::FollowingWaypoints { current_waypoint: tour.at() as u32 };
                outlet.put(&FeedbackMessage { goal_id: id, feedback });
            }
            Feedback::Path(outlet) => {
                let distance_to_goal = progress.distance as f32;
                let feedback = ros::FollowingPath { distance_to_goal, speed: progress.speed as f32 };
                outlet.put(&FeedbackMessage { goal_id: id, feedback });
            }
            Feedback::PathLyrical(outlet) => {
                outlet.put(&FeedbackMessage { goal_id: id, feedback: self.beside(goal, progress) });
            }
            Feedback::PathTo(_) | Feedback::PathThrough(_) => {}
        }
    }

    fn to_pose(&self, goal: &Goal, progress: &Progress) -> ros::NavigationFeedback {
        let Progress { at, distance, remaining, now, .. } = *progress;
        ros::NavigationFeedback {
            goal_id: goal.id,
            current_pose: ros::PoseStamped { header: header(now, &self.frames.map), pose: drawing::pose(at) },
            navigation_time: duration(now.nanoseconds().saturating_sub(goal.stamp.nanoseconds())),
            estimated_time_remaining: duration((remaining * 1e9) as i64),
            number_of_recoveries: 0,
            distance_remaining: distance as f32,
        }
    }

    fn through(&self, goal: &Goal, tour: &Tour, progress: &Progress) -> ros::GoingThroughJazzy {
        let of_one = self.to_pose(goal, progress);
        ros::GoingThroughJazzy {
            current_pose: of_one.current_pose,
            navigation_time: of_one.navigation_time,
            estimated_time_remaining: of_one.estimated_time_remaining,
            number_of_recoveries: 0,
            distance_remaining: of_one.distance_remaining,
            number_of_poses_remaining: tour.remaining() as i16,
        }
    }

    fn beside(&self, goal: &Goal, progress: &Progress) -> ros::FollowingPathLyrical {
        let beside = progress.beside;
        let distance = progress.distance as f32;
        ros::FollowingPathLyrical {
            header: header(progress.now, &self.frames.map),
            position_tracking_error: beside.map_or(0.0, |beside| beside.left as f32),
            heading_tracking_error: beside.map_or(0.0, |beside| beside.turned_right as f32),
            current_path_index: beside.map_or(0, |beside| beside.index as u32),
            robot_pose: self.to_pose(goal, progress).current_pose,
            distance_to_goal: distance,
            speed: progress.speed as f32,
            remaining_path_length: distance,
        }
    }

    /// Answers what has become of a goal of an action; of one that is not known, that it is not.
    pub(crate) fn result(&self, kind: ActionKind, goal: Option<&Goal>, now: ros::Time, asked: &Request) {
        let status = goal.map_or(0, |goal| goal.status.code());
        let error_code = goal.map_or(0, |goal| goal.error);
        let error_msg = short(goal.map_or("", |goal| &goal.why));
        let unknown = Tour::default();
        let tour = goal.and_then(Goal::tour).unwrap_or(&unknown);
        match kind {
            ActionKind::NavigateToPose if self.distribution == Distribution::Humble => {
                asked.reply(&ros::GetResultResponse::<ros::Nothing> { status, ..Default::default() });
            }
            ActionKind::NavigateToPose => {
                let result = ros::Navigated { error_code, error_msg };
                asked.reply(&ros::GetResultResponse { status, result });
            }
            ActionKind::NavigateThroughPoses if self.distribution == Distribution::Jazzy => {
                let result = ros::WentThroughJazzy { error_code, error_msg };
                asked.reply(&ros::GetResultResponse { status, result });
            }
            ActionKind::NavigateThroughPoses => {
                let waypoint_statuses = statuses(tour);
                let result = ros::WentThrough { error_code, error_msg, waypoint_statuses };
                asked.reply(&ros::GetResultResponse { status, result });
            }
            ActionKind::FollowWaypoints if self.distribution == Distribution::Jazzy => {
                let missed_waypoints = missed(tour).into_iter().map(|missed| ros::MissedWaypoint {
                    index: missed.waypoint_index,
                    goal: missed.waypoint_pose,
                    error_code: missed.error_code,
                });
                let missed_waypoints = missed_waypoints.collect();
                let result = ros::FollowedWaypointsJazzy { missed_waypoints, error_code, error_msg };
                asked.reply(&ros::GetResultResponse { status, result });
            }
            ActionKind::FollowWaypoints => {
                let result = ros::FollowedWaypoints { missed_waypoints: missed(tour), error_code, error_msg };
                asked.reply(&ros::GetResultResponse { status, result });
            }
            ActionKind::FollowPath => {
                let result = ros::FollowedPath { result: ros::Nothing::default(), error_code, error_msg };
                asked.reply(&ros::GetResultResponse { status, result });
            }
            ActionKind::ComputePathToPose => {
                let (path, planning_time) = self.path(goal, now);
                let result = ros::PathFound { path, planning_time, error_code, error_msg };
                asked.reply(&ros::GetResultResponse { status, result });
            }
            ActionKind::ComputePathThroughPoses => {
                let (path, planning_time) = self.path(goal, now);
                let result = ros::PathThroughFound { path, planning_time, error_code, error_msg };
                if self.distribution == Distribution::Lyrical {
                    let result = ros::PathThroughFoundLyrical { earlier: result, last_reached_index: -1 };
                    return asked.reply(&ros::GetResultResponse { status, result });
                }
                asked.reply(&ros::GetResultResponse { status, result });
            }
        }
    }

    /// The path that a goal has asked for, and how long it took to find.
    fn path(&self, goal: Option<&Goal>, now: ros::Time) -> (ros::Path, ros::Duration) {
        let head = header(now, &self.frames.map);
        let Some(Task::Path(poses, took)) = goal.map(|goal| &goal.task) else {
            return (ros::Path { header: head, poses: Vec::new() }, ros::Duration::default());
        };
        let stamped = |pose: &Pose2| ros::PoseStamped { header: head.clone(), pose: drawing::pose(*pose) };
        let poses = poses.iter().map(stamped).collect();
        let nanoseconds = i64::try_from(took.as_nanos()).unwrap_or(i64::MAX);
        (ros::Path { header: head, poses }, duration(nanoseconds))
    }
}

/// What has become of each place.
fn statuses(tour: &Tour) -> Vec<ros::WaypointStatus> {
    tour.places().iter().enumerate().map(|(at, place)| waypoint_status(at, place)).collect()
}

/// The places that were not reached.
fn missed(tour: &Tour) -> Vec<ros::WaypointStatus> {
    let is_missed = |(_, place): &(usize, &Place)| matches!(place.end, PlaceEnd::Missed(..));
    tour.places().iter().enumerate().filter(is_missed).map(|(at, place)| waypoint_status(at, place)).collect()
}

fn waypoint_status(at: usize, place: &Place) -> ros::WaypointStatus {
    let (waypoint_status, error_code, why) = match &place.end {
        PlaceEnd::Pending => (0, 0, ""),
        PlaceEnd::Reached => (1, 0, ""),
        PlaceEnd::Missed(error, why) => (3, *error, why.as_str()),
    };
    let waypoint_pose = place.pose.clone();
    ros::WaypointStatus {
        waypoint_status,
        waypoint_index: at as u32,
        waypoint_pose,
        error_code,
        error_msg: short(why),
    }
}

/// No more of a text than a message may have.
fn short(text: &str) -> String {
    text[..text.floor_char_boundary(TEXT)].to_owned()
}

fn duration(nanoseconds: i64) -> ros::Duration {
    let ros::Time { sec, nanosec } = ros::Time::from_nanoseconds(nanoseconds.max(0));
    ros::Duration { sec, nanosec }
}
