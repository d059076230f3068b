//! Asking a generator for candidates.

use crate::check::{checks, count, id, number, optional, parameters, part};
use crate::limits::MAX_BUDGET_MS;
use crate::{CandidateSet, LaserModel, MapId, RobotModel, Scene, Tree};
use ciborium::Value;
use serde::{Deserialize, Serialize};

/// Everything a generator needs; it keeps nothing between requests but what it derived from the map.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GenerateRequest {
    /// Arbiter's incarnation.
    pub epoch: u64,
    /// Planning cycle within the epoch.
    pub seq: u64,
    /// Time left for the answer, ms.
    pub budget_ms: u32,
    /// The map, by hash.
    pub map: MapId,
    /// Map frame, m.
    pub goal_x: f64,
    /// Map frame, m.
    pub goal_y: f64,
    /// The moment to plan from.
    pub scene: Scene,
    /// The tree of the previous reply; absent on the first cycle and after a change of goal.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tree: Option<Tree>,
    /// Seed of this cycle: the reply is a function of the request alone.
    pub seed: u64,
    /// Iterations to spend; 0 asks only to warm up for the map.
    pub iterations: u32,
    /// Which generator of the service.
    pub generator: String,
    /// Shape and limits of the robot.
    pub robot_model: RobotModel,
    /// Laser, for generators that look for landmarks.
    pub laser: LaserModel,
    /// The generator's parameters: a map.
    pub params: Value,
}

checks! { request: GenerateRequest {
    budget_ms: count(0, MAX_BUDGET_MS as usize);
    generator: id;
    goal_x, goal_y: number;
    scene: part;
    tree: optional(part);
    robot_model: part;
    laser: part;
    params: parameters;
}}

/// Candidates, and the tree to hand back next time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct GenerateReply {
    /// Of the request that it answers.
    pub epoch: u64,
    /// Cycle of the request.
    pub seq: u64,
    /// Which replica answers.
    pub instance: String,
    /// Collision-free trajectories from the scene's pose; none after a warm-up.
    pub candidates: CandidateSet,
    /// The tree as it is now.
    pub tree: Tree,
    /// Time spent, microseconds.
    pub elapsed_us: u64,
    /// Whether the budget ended its growth: another machine would have grown another tree.
    pub cut: bool,
}

checks! { reply: GenerateReply {
    instance: id;
    candidates: part;
    tree: part;
}}
