//! What the arbiter decides and what the driver makes of it.

use crate::check::{array, checks, keys, length, list, non_negative, number, part, positive};
use crate::limits::{MAX_LIST, MAX_STEPS};
use crate::{CommandReason, Degradation, F64Array, Reason};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use strum::IntoStaticStr;

/// What to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Action {
    /// Follow the chosen candidate, which every active term has scored.
    Follow,
    /// Follow the tail of the previous decision, still valid and free of collision.
    Hold,
    /// Brake and stand.
    Stop,
}

/// What scored the candidates of a cycle.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Evaluated {
    /// The replicas.
    Pool,
    /// The arbiter itself, because no replica answered in time or it always evaluates the term itself.
    Local,
    /// Nothing.
    None,
}

/// The end of every planning cycle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Decision {
    /// Arbiter's incarnation: the driver refuses lower ones than it has seen.
    pub epoch: u64,
    /// Planning cycle within the epoch.
    pub seq: u64,
    /// Tick of the scene.
    pub tick: u64,
    /// Stamp of the scene, robot clock, s.
    pub stamp: f64,
    /// How long after the stamp it may be followed, s.
    pub valid_for_s: f64,
    /// What to do.
    pub action: Action,
    /// Why.
    pub reason: Reason,
    /// Whether the robot is believed to be at the goal.
    pub arrived: bool,
    /// Identifier of the candidate followed; absent for `stop`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub candidate: Option<u32>,
    /// Between states, s.
    pub dt: f64,
    /// `[K]` trajectory, map frame, m; state k (from 0) is due `(k + 1) * dt` after the stamp. Empty for `stop`.
    pub x: F64Array,
    /// `[K]`, map frame, m.
    pub y: F64Array,
    /// `[K]`, map frame, rad.
    pub heading: F64Array,
    /// `[K]` forward speed that leads to the state, m/s.
    pub v: F64Array,
    /// `[K]` turn rate that leads to the state, rad/s.
    pub omega: F64Array,
    /// Trace of the belief's position covariance, m^2.
    pub uncertainty: f64,
    /// Whether it counts as uncertain.
    pub uncertain: bool,
    /// By term: what scored it.
    pub evaluated: BTreeMap<String, Evaluated>,
    /// What was not as it should be; empty in a healthy cycle.
    pub degraded: Vec<Degradation>,
    /// Time spent on the cycle, microseconds.
    pub elapsed_us: u64,
}

checks! { decision: Decision {
    uncertainty: number;
    reason: part;
    stamp: number;
    valid_for_s: non_negative;
    dt: positive;
    x: length(usize::from(decision.action != Action::Stop), MAX_STEPS);
    x, y, heading, v, omega: array(decision.x.len());
    evaluated: keys(MAX_LIST);
    degraded: list(MAX_LIST, part);
}}

/// What the base is to do now, and what becomes of the newest decision.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Twist {
    /// The grant of the base under which the driver drives; a base obeys no other.
    pub lease: u64,
    /// Of the newest decision that the driver has taken; 0 before the first.
    pub epoch: u64,
    /// Of the same decision.
    pub seq: u64,
    /// Tick it answers.
    pub tick: u64,
    /// Robot clock, s.
    pub stamp: f64,
    /// Forward speed, m/s.
    pub v: f64,
    /// Turn rate, rad/s.
    pub omega: f64,
    /// What the driver does with the decision, and why.
    pub reason: CommandReason,
    /// Stamp of the first command since which the reason has been this one, robot clock, s.
    pub since: f64,
}

checks! { twist: Twist {
    stamp, v, omega, since: number;
}}
