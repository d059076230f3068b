//! What a robot is to do, and how to ask for it.

use crate::check::{
    Checked, checks, count, covariance, id, list, number, numbers, optional, parameters, part, positive,
    shape, size, within,
};
use crate::limits::{MAX_HEADING, MAX_LIST, MAX_WAY_POINTS};
use crate::{
    Clock, F64Array, LaserModel, MapId, MissionEnd, MissionState, OdometryNoise, Pose, Reject, RobotModel,
};
use ciborium::Value;
use serde::{Deserialize, Serialize};
use strum::EnumDiscriminants;

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
    /// Whether the initial pose may be wrong, as one that was kept from a day before: localisation is in doubt until
    /// scans have confirmed it.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub initial_doubtful: bool,
    /// Map frame, m.
    pub goal_x: f64,
    /// Map frame, m.
    pub goal_y: f64,
    /// Heading to arrive with, rad; absent if any will do.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub goal_heading: Option<f64>,
    /// The way to the goal: x and y of each of its points, m in the map frame, from the robot to the goal. Absent if
    /// the robot may choose it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub way: Option<F64Array>,
    /// Distance at which the goal counts as reached, m.
    pub goal_tolerance: f64,
    /// Planner profile: a map (generator, terms, arbitration).
    pub profile: Value,
    /// The localiser's parameters: a map.
    pub localizer: Value,
    /// Parameters of the tracker of people: a map; absent if none differs from its default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tracker: Option<Value>,
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

impl MissionOrder {
    /// Whether a role must be ready before the mission runs.
    pub fn requires(&self, role: &str) -> bool {
        self.require.iter().any(|required| required == role)
    }

    /// The tracker's parameters: none that differs, if none are given.
    pub fn tracker_parameters(&self) -> Value {
        self.tracker.clone().unwrap_or_else(|| Value::Map(Vec::new()))
    }
}

/// A robot's mission and where it stands. The driver owns it and publishes every change.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Mission {
    /// The grant of the base under which the driver drives; 0 if it has none.
    pub lease: u64,
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

impl Mission {
    /// Whether no robot is to drive by it any more.
    pub fn is_over(&self) -> bool {
        matches!(self.state, MissionState::Cancelled | MissionState::Finished)
    }
}

/// The points of a way: at least two, with two numbers each.
fn points(field: &str, way: &F64Array) -> Checked {
    size(field, way.len() / 2, 2, MAX_WAY_POINTS)?;
    shape(field, way.len(), way.len() / 2 * 2)?;
    numbers(field, way)
}

checks! { order: MissionOrder {
    robot: id;
    initial_pose: part;
    initial_covariance: covariance;
    goal_x, goal_y: number;
    goal_heading: optional(within(-MAX_HEADING, MAX_HEADING));
    way: optional(points);
    profile, localizer: parameters;
    tracker: optional(parameters);
    laser: part;
    robot_model: part;
    odometry_noise: part;
    goal_tolerance, time_scale, tick_s: positive;
    tick_s: within(0.001, 10.0);
    time_scale: within(0.001, 1000.0);
    plan_every: count(1, u32::MAX as usize);
    require: list(MAX_LIST, id);
}}

checks! { mission: Mission {
    order: part;
    ready: list(MAX_LIST, id);
    end: optional(part);
}}

/// A request about a robot's mission; the reply is the [`Mission`] as it is then.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, EnumDiscriminants)]
#[serde(tag = "kind", rename_all = "snake_case", try_from = "CommandFields")]
#[strum_discriminants(name(CommandKind), vis(), derive(Deserialize), serde(rename_all = "snake_case"))]
#[expect(missing_docs, reason = "the text of each command says what its fields are")]
pub enum MissionCommand {
    /// Begin this mission.
    Set { order: Box<MissionOrder> },
    /// Go elsewhere on the same map: m in the map frame, and rad, absent if any heading will do.
    Goal {
        x: f64,
        y: f64,
        #[serde(skip_serializing_if = "Option::is_none")]
        heading: Option<f64>,
        /// The way there, as of an order. A robot that is on a way and is given another goes on without a stop.
        #[serde(skip_serializing_if = "Option::is_none")]
        way: Option<F64Array>,
    },
    /// Give up.
    Cancel,
    /// The run of this revision is over.
    Finish { revision: u64, end: MissionEnd },
}

/// What is read of a command. Serde reads a tagged enum through a buffer, which cannot hold CBOR tags.
#[derive(Deserialize)]
struct CommandFields {
    kind: CommandKind,
    order: Option<Box<MissionOrder>>,
    x: Option<f64>,
    y: Option<f64>,
    heading: Option<f64>,
    way: Option<F64Array>,
    revision: Option<u64>,
    end: Option<MissionEnd>,
}

impl TryFrom<CommandFields> for MissionCommand {
    type Error = &'static str;

    fn try_from(fields: CommandFields) -> Result<Self, Self::Error> {
        let CommandFields { kind, order, x, y, heading, way, revision, end } = fields;
        Ok(match kind {
            CommandKind::Set => Self::Set { order: order.ok_or("`set` needs `order`")? },
            CommandKind::Goal => {
                let x = x.ok_or("`goal` needs `x`")?;
                let y = y.ok_or("`goal` needs `y`")?;
                Self::Goal { x, y, heading, way }
            }
            CommandKind::Cancel => Self::Cancel,
            CommandKind::Finish => Self::Finish {
                revision: revision.ok_or("`finish` needs `revision`")?,
                end: end.ok_or("`finish` needs `end`")?,
            },
        })
    }
}

checks! { MissionCommand {
    Set { order: |field: &str, order: &MissionOrder| part(field, order) }
    Goal { x: number, y: number, heading: optional(within(-MAX_HEADING, MAX_HEADING)), way: optional(points) }
    Finish { end: part }
}}

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

checks! { readiness: Readiness {
    role, instance: id;
    refused: optional(part);
}}
