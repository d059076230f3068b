//! What a robot is to do, and how to ask for it.

use crate::array::F64Array;
use crate::check;
use crate::limits::MAX_LIST;
use crate::map::MapId;
use crate::message::Validate;
use crate::model::{LaserModel, OdometryNoise, Pose, RobotModel};
use crate::reject::Reject;
use ciborium::Value;
use serde::{Deserialize, Serialize};

/// How time passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Clock {
    /// Every stream is awaited: a slow machine changes no decision.
    Lockstep,
    /// The newest wins; budgets are real.
    Realtime,
}

/// Where a mission stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum MissionState {
    /// Waiting for the required roles to report ready.
    Preparing,
    /// Under way.
    Running,
    /// Halted until resumed.
    Paused,
    /// Given up on request.
    Cancelled,
    /// At its end.
    Finished,
}

/// Everything the services of a robot share: published on one key with a revision that grows with every change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mission {
    /// Counts the missions begun on this robot; a changed goal keeps it. Ticks start at 0 with each.
    pub run: u64,
    /// Grows with every change; readiness is reported for one revision.
    pub revision: u64,
    /// Robot.
    pub robot: String,
    /// The map, by hash.
    pub map: MapId,
    /// Map frame: where localisation starts.
    pub initial_pose: Pose,
    /// Covariance of the initial (x, y, heading), row-major 3x3; m^2, m rad, rad^2.
    pub initial_covariance: F64Array,
    /// Map frame, m.
    pub goal_x: f64,
    /// Map frame, m.
    pub goal_y: f64,
    /// Heading to arrive with, rad; absent if any will do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal_heading: Option<f64>,
    /// Distance at which the goal counts as reached, m.
    pub goal_tolerance: f64,
    /// Planner profile: a map (generator, terms, arbitration).
    pub profile: Value,
    /// The localiser's parameters: a map.
    pub localizer: Value,
    /// Laser.
    pub laser: LaserModel,
    /// Shape and limits of the robot.
    pub robot_model: RobotModel,
    /// Noise of dead reckoning.
    pub odometry_noise: OdometryNoise,
    /// Seed of every random choice.
    pub seed: u64,
    /// How time passes.
    pub clock: Clock,
    /// Simulated seconds a second of wall time, with a real-time clock.
    pub time_scale: f64,
    /// Between ticks, s.
    pub tick_s: f64,
    /// Ticks between plans.
    pub plan_every: u32,
    /// Roles that must be ready before the mission runs.
    pub require: Vec<String>,
    /// Roles that have reported ready for this revision.
    pub ready: Vec<String>,
    /// Where it stands.
    pub state: MissionState,
    /// Whether it has been under way in this run: the robot may have left its start.
    pub has_run: bool,
    /// Why it was finished or refused, for people; empty while there is nothing to say.
    pub note: String,
}

impl std::fmt::Display for MissionState {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(match self {
            Self::Preparing => "preparing",
            Self::Running => "running",
            Self::Paused => "paused",
            Self::Cancelled => "cancelled",
            Self::Finished => "finished",
        })
    }
}

impl Validate for Mission {
    fn validate(&self) -> Result<(), Reject> {
        check::id("robot", &self.robot)?;
        check::part("initial_pose", &self.initial_pose)?;
        check::covariance("initial_covariance", &self.initial_covariance)?;
        check::numbers(&[("goal_x", self.goal_x), ("goal_y", self.goal_y)])?;
        check::optional("goal_heading", self.goal_heading)?;
        check::parameters("profile", &self.profile)?;
        check::parameters("localizer", &self.localizer)?;
        check::part("laser", &self.laser)?;
        check::part("robot_model", &self.robot_model)?;
        check::part("odometry_noise", &self.odometry_noise)?;
        check::positive(&[
            ("goal_tolerance", self.goal_tolerance),
            ("time_scale", self.time_scale),
            ("tick_s", self.tick_s),
        ])?;
        check::within("tick_s", self.tick_s, 0.001, 10.0)?;
        check::within("time_scale", self.time_scale, 0.001, 1000.0)?;
        check::one_to("plan_every", self.plan_every as usize, u32::MAX as usize)?;
        check::ids("require", self.require.iter(), MAX_LIST)?;
        check::ids("ready", self.ready.iter(), MAX_LIST)?;
        check::text("note", &self.note)
    }
}

/// A wish about a robot's mission; the reply is the [`Mission`] as it is then.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "MissionRequestWire", into = "MissionRequestWire")]
pub enum MissionRequest {
    /// Begin this mission.
    Set {
        /// Its revision is ignored: the keeper counts.
        mission: Box<Mission>,
    },
    /// A service is prepared.
    Ready {
        /// What it does.
        role: String,
        /// Which one it is.
        instance: String,
        /// For which revision.
        revision: u64,
    },
    /// Go elsewhere on the same map.
    Goal {
        /// Map frame, m.
        x: f64,
        /// Map frame, m.
        y: f64,
        /// Rad; absent if any will do.
        heading: Option<f64>,
    },
    /// Halt.
    Pause,
    /// Go on.
    Resume,
    /// Give up.
    Cancel,
    /// It is over.
    Finish {
        /// Of which revision.
        revision: u64,
        /// For a person.
        reason: String,
    },
}

/// The map a request is on the wire. Serde's own tagged enums cannot hold CBOR tags.
#[derive(Serialize, Deserialize)]
struct MissionRequestWire {
    kind: RequestKind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    mission: Option<Box<Mission>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    role: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    instance: Option<String>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    revision: Option<u64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    x: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    y: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    heading: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    reason: Option<String>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum RequestKind {
    Set,
    Ready,
    Goal,
    Pause,
    Resume,
    Cancel,
    Finish,
}

impl From<MissionRequest> for MissionRequestWire {
    fn from(request: MissionRequest) -> Self {
        let of = |kind| Self {
            kind,
            mission: None,
            role: None,
            instance: None,
            revision: None,
            x: None,
            y: None,
            heading: None,
            reason: None,
        };
        match request {
            MissionRequest::Set { mission } => Self { mission: Some(mission), ..of(RequestKind::Set) },
            MissionRequest::Ready { role, instance, revision } => Self {
                role: Some(role),
                instance: Some(instance),
                revision: Some(revision),
                ..of(RequestKind::Ready)
            },
            MissionRequest::Goal { x, y, heading } => {
                Self { x: Some(x), y: Some(y), heading, ..of(RequestKind::Goal) }
            }
            MissionRequest::Pause => of(RequestKind::Pause),
            MissionRequest::Resume => of(RequestKind::Resume),
            MissionRequest::Cancel => of(RequestKind::Cancel),
            MissionRequest::Finish { revision, reason } => {
                Self { revision: Some(revision), reason: Some(reason), ..of(RequestKind::Finish) }
            }
        }
    }
}

impl TryFrom<MissionRequestWire> for MissionRequest {
    type Error = &'static str;

    fn try_from(wire: MissionRequestWire) -> Result<Self, Self::Error> {
        Ok(match wire.kind {
            RequestKind::Set => Self::Set { mission: wire.mission.ok_or("`set` needs `mission`")? },
            RequestKind::Ready => Self::Ready {
                role: wire.role.ok_or("`ready` needs `role`")?,
                instance: wire.instance.ok_or("`ready` needs `instance`")?,
                revision: wire.revision.ok_or("`ready` needs `revision`")?,
            },
            RequestKind::Goal => Self::Goal {
                x: wire.x.ok_or("`goal` needs `x`")?,
                y: wire.y.ok_or("`goal` needs `y`")?,
                heading: wire.heading,
            },
            RequestKind::Pause => Self::Pause,
            RequestKind::Resume => Self::Resume,
            RequestKind::Cancel => Self::Cancel,
            RequestKind::Finish => Self::Finish {
                revision: wire.revision.ok_or("`finish` needs `revision`")?,
                reason: wire.reason.ok_or("`finish` needs `reason`")?,
            },
        })
    }
}

impl Validate for MissionRequest {
    fn validate(&self) -> Result<(), Reject> {
        match self {
            Self::Set { mission } => check::part("mission", mission.as_ref()),
            Self::Ready { role, instance, .. } => {
                check::id("role", role)?;
                check::id("instance", instance)
            }
            Self::Goal { x, y, heading } => {
                check::numbers(&[("x", *x), ("y", *y)])?;
                check::optional("heading", *heading)
            }
            Self::Pause | Self::Resume | Self::Cancel => Ok(()),
            Self::Finish { reason, .. } => check::text("reason", reason),
        }
    }
}
