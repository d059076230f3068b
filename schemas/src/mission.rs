//! What a robot is to do, and how to ask for it.

use crate::array::F64Array;
use crate::check;
use crate::limits::MAX_LIST;
use crate::map::MapId;
use crate::message::Validate;
use crate::mission_state::{Clock, MissionState};
use crate::model::{LaserModel, OdometryNoise, Pose, RobotModel};
use crate::reason::MissionEnd;
use crate::reject::Reject;
use ciborium::Value;
use serde::{Deserialize, Serialize};

/// What a robot is to do, as the client that gives the mission says it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MissionOrder {
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
    /// Simulated seconds per second of wall time, with a real-time clock.
    pub time_scale: f64,
    /// Between ticks, s.
    pub tick_s: f64,
    /// Ticks between plans.
    pub plan_every: u32,
    /// Roles that must be ready before the mission runs.
    pub require: Vec<String>,
}

/// A robot's mission and where it stands. The driver owns it and publishes every change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mission {
    /// Counts the missions begun on this robot; a changed goal keeps it. Ticks start at 0 with each.
    pub run: u64,
    /// Grows with every change of what is to be done; readiness is reported for one revision.
    pub revision: u64,
    /// What to do.
    pub order: MissionOrder,
    /// Roles that have reported ready for this revision.
    pub ready: Vec<String>,
    /// Where it stands.
    pub state: MissionState,
    /// Whether it has been under way in this run: the robot may have left its start.
    pub has_run: bool,
    /// How it ended; present once it is cancelled or finished.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub end: Option<MissionEnd>,
}

impl Validate for MissionOrder {
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
        check::ids("require", self.require.iter(), MAX_LIST)
    }
}

impl Validate for Mission {
    fn validate(&self) -> Result<(), Reject> {
        check::part("order", &self.order)?;
        check::ids("ready", self.ready.iter(), MAX_LIST)?;
        self.end.as_ref().map_or(Ok(()), |end| check::part("end", end))
    }
}

/// A request about a robot's mission; the reply is the [`Mission`] as it is then.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(try_from = "CommandFields", into = "CommandFields")]
pub enum MissionCommand {
    /// Begin this mission.
    Set {
        /// What to do.
        order: Box<MissionOrder>,
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
    /// The run is over.
    Finish {
        /// Of which revision.
        revision: u64,
        /// How it ended.
        end: MissionEnd,
    },
}

/// The map that a command is on the wire. Serde's own tagged enums cannot hold CBOR tags.
#[derive(Serialize, Deserialize)]
struct CommandFields {
    kind: CommandKind,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    order: Option<Box<MissionOrder>>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    x: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    y: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    heading: Option<f64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    revision: Option<u64>,
    #[serde(default, skip_serializing_if = "Option::is_none")]
    end: Option<MissionEnd>,
}

#[derive(Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
enum CommandKind {
    Set,
    Goal,
    Pause,
    Resume,
    Cancel,
    Finish,
}

impl From<MissionCommand> for CommandFields {
    fn from(command: MissionCommand) -> Self {
        let of =
            |kind| Self { kind, order: None, x: None, y: None, heading: None, revision: None, end: None };
        match command {
            MissionCommand::Set { order } => Self { order: Some(order), ..of(CommandKind::Set) },
            MissionCommand::Goal { x, y, heading } => {
                Self { x: Some(x), y: Some(y), heading, ..of(CommandKind::Goal) }
            }
            MissionCommand::Pause => of(CommandKind::Pause),
            MissionCommand::Resume => of(CommandKind::Resume),
            MissionCommand::Cancel => of(CommandKind::Cancel),
            MissionCommand::Finish { revision, end } => {
                Self { revision: Some(revision), end: Some(end), ..of(CommandKind::Finish) }
            }
        }
    }
}

impl TryFrom<CommandFields> for MissionCommand {
    type Error = &'static str;

    fn try_from(fields: CommandFields) -> Result<Self, Self::Error> {
        Ok(match fields.kind {
            CommandKind::Set => Self::Set { order: fields.order.ok_or("`set` needs `order`")? },
            CommandKind::Goal => Self::Goal {
                x: fields.x.ok_or("`goal` needs `x`")?,
                y: fields.y.ok_or("`goal` needs `y`")?,
                heading: fields.heading,
            },
            CommandKind::Pause => Self::Pause,
            CommandKind::Resume => Self::Resume,
            CommandKind::Cancel => Self::Cancel,
            CommandKind::Finish => Self::Finish {
                revision: fields.revision.ok_or("`finish` needs `revision`")?,
                end: fields.end.ok_or("`finish` needs `end`")?,
            },
        })
    }
}

impl Validate for MissionCommand {
    fn validate(&self) -> Result<(), Reject> {
        match self {
            Self::Set { order } => check::part("order", order.as_ref()),
            Self::Goal { x, y, heading } => {
                check::numbers(&[("x", *x), ("y", *y)])?;
                check::optional("heading", *heading)
            }
            Self::Pause | Self::Resume | Self::Cancel => Ok(()),
            Self::Finish { end, .. } => check::part("end", end),
        }
    }
}

/// What has become of a service's preparing for a mission; the reply is the [`Mission`] as it is then.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Readiness {
    /// The service's role.
    pub role: String,
    /// The service's instance.
    pub instance: String,
    /// The revision of the mission that it has prepared for.
    pub revision: u64,
    /// Why it can never be ready for this revision; absent: it is ready.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub refused: Option<Reject>,
}

impl Validate for Readiness {
    fn validate(&self) -> Result<(), Reject> {
        check::id("role", &self.role)?;
        check::id("instance", &self.instance)?;
        self.refused.as_ref().map_or(Ok(()), |reject| check::part("refused", reject))
    }
}
