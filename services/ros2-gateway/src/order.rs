//! The missions that the gateway orders.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::{Footprint, RobotModel};
use curionav_planning::sensor::LaserModel;
use curionav_ros2::messages as ros;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::kept_pose::KeptPose;
use curionav_runtime::robot_limits::RobotLimits;
use curionav_schemas::{Belief, Clock, Confidence, F64Array, MapId, MissionOrder, Reject, Value, keys};

use crate::config::{PeopleSource, Ros2Config};
use crate::fault::{Fault, FaultKind};
use crate::frames::planar;

/// Roles that every mission needs; a robot that is not localised by Nav2 also needs a localizer.
const REQUIRED: [&str; 2] = ["arbiter", "driver"];
/// In real time the arbiter plans about so often, seconds, if ticks come that often.
const PLANNING_PERIOD: f64 = 0.1;

/// Where the robot is said to be when a run begins.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Start {
    /// In the map.
    pub(crate) pose: Pose2,
    /// Covariance of (x, y, heading), row by row.
    pub(crate) covariance: F64Array,
    /// The map of a pose that was kept, which the robot may have left since; none of one that is told.
    pub(crate) kept_on: Option<String>,
}

impl Start {
    /// What a message says of it.
    ///
    /// # Errors
    /// If its pose is not planar, or its covariance is none.
    pub(crate) fn said(said: &ros::PoseWithCovarianceStamped) -> Result<Self, Fault> {
        const PLACES: [usize; 3] = [0, 1, 5];
        let entries = PLACES.iter().flat_map(|i| PLACES.iter().map(|j| said.pose.covariance[*i][*j]));
        let covariance: Vec<f64> = entries.collect();
        let is_one =
            covariance.iter().all(|c| c.is_finite()) && [0, 4, 8].iter().all(|i| covariance[*i] >= 0.0);
        if !is_one {
            return Err(Fault::malformed("its covariance is none"));
        }
        Ok(Self { pose: planar(&said.pose.pose)?, covariance: covariance.into(), kept_on: None })
    }

    /// Where the localizer believes the robot to be, unless it does not know.
    pub(crate) fn believed(belief: &Belief) -> Option<Self> {
        let pose = Pose2::new(belief.x, belief.y, belief.heading);
        let is_known = belief.health.confidence != Confidence::Lost;
        is_known.then(|| Self { pose, covariance: belief.covariance.clone(), kept_on: None })
    }

    /// Whether it can be used on a map of this hash.
    ///
    /// # Errors
    /// If it was kept on another one.
    pub(crate) fn check_map(&self, map: &str) -> Result<(), Fault> {
        if self.kept_on.as_deref().is_none_or(|kept_on| kept_on == map) {
            return Ok(());
        }
        Err(Fault::new(FaultKind::NotYet, "the kept pose is on another map: give an initial pose"))
    }

    /// Where the robot is when it is switched on, if its configuration says so.
    pub(crate) fn configured(config: &Ros2Config) -> Option<Self> {
        let pose = config.mission.initial_pose.as_deref()?;
        let [x, y, heading] = [0, 1, 2].map(|i| pose.get(i).copied().unwrap_or_default());
        Some(Self::within(Pose2::new(x, y, heading), config.mission.initial_sigma))
    }

    /// Where the robot was last sure to be, if that was kept.
    pub(crate) fn kept(service: &ServiceConfig, config: &Ros2Config) -> Option<Self> {
        let path = service.kept_pose()?;
        let kept = match KeptPose::read(&path) {
            Ok(kept) => kept.filter(|kept| kept.robot == service.robot)?,
            Err(error) => {
                tracing::warn!(%error, "the kept pose is not used");
                return None;
            }
        };
        tracing::info!(path = %path.display(), "the robot is taken to be where it was last");
        let start = Self::within(convert::pose(kept.pose), config.mission.initial_sigma);
        Some(Self { kept_on: Some(kept.map), ..start })
    }

    /// A pose that is known to within these standard deviations.
    fn within(pose: Pose2, sigma: [f64; 3]) -> Self {
        let mut covariance = vec![0.0; 9];
        sigma.iter().enumerate().for_each(|(i, sigma)| covariance[4 * i] = sigma * sigma);
        Self { pose, covariance: covariance.into(), kept_on: None }
    }
}

/// What all missions of the robot have in common.
#[derive(Debug, Clone)]
pub(crate) struct Orders {
    robot: String,
    config: Ros2Config,
    limits: RobotLimits,
    profile: Value,
    localizer: Value,
    tracker: Option<Value>,
}

impl Orders {
    /// The robot's name.
    pub(crate) fn robot(&self) -> &str {
        &self.robot
    }

    /// Of a robot with these limits.
    ///
    /// # Errors
    /// If the profile is missing or a parameter is wrong.
    pub(crate) fn new(robot: &str, config: &Ros2Config, limits: &RobotLimits) -> anyhow::Result<Self> {
        config.check_against(limits)?;
        let tracked = config.people == PeopleSource::Tracker;
        Ok(Self {
            robot: robot.to_owned(),
            profile: convert::to_value(&config.profile()?)?,
            localizer: convert::to_value(&config.mission.localizer)?,
            tracker: tracked.then(|| convert::to_value(&config.tracker())).transpose()?,
            config: config.clone(),
            limits: limits.clone(),
        })
    }

    /// A mission to `goal`, and to `heading` if that matters, on `map`.
    ///
    /// # Errors
    /// If no service could work with it.
    pub(crate) fn order(
        &self,
        map: MapId,
        laser: &LaserModel,
        start: &Start,
        (goal, heading): (Point2, Option<f64>),
    ) -> Result<MissionOrder, Reject> {
        let RobotLimits { v_max, a_max, omega_max, alpha_max, v_reverse, radius, tick_s, .. } = self.limits;
        let footprint = Footprint::Disc { radius };
        let robot = RobotModel { footprint, v_max, a_max, omega_max, alpha_max, v_reverse };
        let localizer = (!self.config.is_controller()).then_some("localizer");
        let tracker = self.tracker.is_some().then_some(keys::TRACKER);
        let order = MissionOrder {
            robot: self.robot.clone(),
            map,
            initial_pose: convert::pose_to_wire(start.pose),
            initial_covariance: start.covariance.clone(),
            initial_doubtful: start.kept_on.is_some(),
            goal_x: goal.x,
            goal_y: goal.y,
            goal_heading: heading,
            way: None,
            goal_tolerance: self.config.mission.goal_tolerance,
            profile: self.profile.clone(),
            localizer: self.localizer.clone(),
            tracker: self.tracker.clone(),
            laser: convert::laser_to_wire(laser),
            robot_model: convert::robot_model_to_wire(&robot),
            odometry_noise: convert::noise_to_wire(&self.config.mission.odometry_noise),
            seed: 1,
            clock: Clock::Realtime,
            time_scale: 1.0,
            tick_s,
            plan_every: (PLANNING_PERIOD / tick_s).ceil().max(1.0) as u32,
            require: REQUIRED.into_iter().chain(localizer).chain(tracker).map(String::from).collect(),
        };
        convert::check_order(&order)?;
        Ok(order)
    }
}
