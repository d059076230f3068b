//! Asking an evaluator for the costs of a shard of candidates.

use crate::check::{checks, count, id, length, number, numbers, parameters, part};
use crate::limits::{MAX_BUDGET_MS, MAX_CANDIDATES};
use crate::{CandidateShard, F64Array, LaserModel, MapId, OdometryNoise, RobotModel, Scene};
use ciborium::Value;
use serde::{Deserialize, Serialize};

/// Everything a cost may depend on. A candidate's cost is a function of the rest of the request and of that candidate
/// alone, never of its neighbours in the shard.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct EvaluateRequest {
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
    pub candidates: CandidateShard,
    /// The term's parameters: a map.
    pub params: Value,
}

checks! { request: EvaluateRequest {
    budget_ms: count(0, MAX_BUDGET_MS as usize);
    goal_x, goal_y: number;
    laser: part;
    robot_model: part;
    odometry_noise: part;
    scene: part;
    candidates: part;
    params: parameters;
}}

/// Raw costs of a shard, one per candidate, in its order; lower is better.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scores {
    /// Of the request that it answers.
    pub epoch: u64,
    /// Cycle of the request.
    pub seq: u64,
    /// Shard of the request.
    pub shard: u32,
    /// Which term.
    pub term: String,
    /// Which replica answers.
    pub instance: String,
    /// `[candidates of the shard]`, in the term's own unit.
    pub cost: F64Array,
    /// Microseconds of computing, without what was waited for a slot.
    pub elapsed_us: u64,
    /// Shards it computes at once.
    pub slots: u32,
}

checks! { scores: Scores {
    term: id;
    slots: count(1, MAX_CANDIDATES);
    instance: id;
    cost: length(0, MAX_CANDIDATES);
    cost: numbers;
}}
