//! Asking an evaluator for the costs of a shard of candidates.

use crate::array::F64Array;
use crate::candidates::CandidateSet;
use crate::check;
use crate::limits::MAX_CANDIDATES;
use crate::map::MapId;
use crate::message::Validate;
use crate::model::{LaserModel, OdometryNoise, RobotModel};
use crate::reject::Reject;
use crate::scene::Scene;
use ciborium::Value;
use serde::{Deserialize, Serialize};

/// Everything a cost may depend on. A candidate's cost is a function of the rest of the request and of that candidate
/// alone, never of its neighbours in the shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EvaluateRequest {
    /// Who asks.
    pub robot: String,
    /// Arbiter's incarnation.
    pub epoch: u64,
    /// Planning cycle within the epoch.
    pub seq: u64,
    /// Which part of the batch this is.
    pub shard: u32,
    /// Time left for the answer, ms.
    pub budget_ms: u32,
    /// The map, by hash.
    pub map: MapId,
    /// Map frame, m.
    pub goal_x: f64,
    /// Map frame, m.
    pub goal_y: f64,
    /// Laser.
    pub laser: LaserModel,
    /// Shape and limits of the robot.
    pub robot_model: RobotModel,
    /// Noise of dead reckoning.
    pub odometry_noise: OdometryNoise,
    /// The moment the candidates start from.
    pub scene: Scene,
    /// The shard; empty asks only to warm up for the map.
    pub candidates: CandidateSet,
    /// The metric's parameters: a map.
    pub params: Value,
}

impl Validate for EvaluateRequest {
    fn validate(&self) -> Result<(), Reject> {
        check::id("robot", &self.robot)?;
        check::numbers(&[("goal_x", self.goal_x), ("goal_y", self.goal_y)])?;
        check::part("laser", &self.laser)?;
        check::part("robot_model", &self.robot_model)?;
        check::part("odometry_noise", &self.odometry_noise)?;
        check::part("scene", &self.scene)?;
        check::part("candidates", &self.candidates)?;
        check::parameters("params", &self.params)
    }
}

/// Raw costs of a shard, one a candidate, in its order; lower is better.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// As in the request.
    pub epoch: u64,
    /// As in the request.
    pub seq: u64,
    /// As in the request.
    pub shard: u32,
    /// What was measured.
    pub metric: String,
    /// Who answers.
    pub instance: String,
    /// `[candidates of the shard]`, in the metric's own unit.
    pub cost: F64Array,
    /// Microseconds from the request's arrival to the answer, waiting for a slot included.
    pub elapsed_us: u64,
    /// Shards it computes at once; absent means one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub slots: Option<u32>,
}

impl Validate for Scores {
    fn validate(&self) -> Result<(), Reject> {
        check::id("metric", &self.metric)?;
        check::id("instance", &self.instance)?;
        check::at_most("cost", self.cost.len(), MAX_CANDIDATES)?;
        check::array_numbers("cost", &self.cost)
    }
}
