//! What the arbiter carries from one cycle into the next.

use crate::check::{
    array, ascending, checks, id, length, list, non_negative, number, optional, part, positive, text,
};
use crate::limits::{MAX_PEOPLE, MAX_STEPS, MAX_TREES};
use crate::{F64Array, Tree, Twist, U32Array};
use serde::{Deserialize, Serialize};

/// What was carried into a cycle. With the mission and the scene of the cycle's report it decides the cycle.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Memory {
    /// Robot.
    pub robot: String,
    /// Arbiter's incarnation.
    pub epoch: u64,
    /// Planning cycle it was carried into.
    pub seq: u64,
    /// Run of the mission in force.
    pub run: u64,
    /// Revision of the mission in force.
    pub revision: u64,
    /// Version of the arbiter's program.
    pub version: String,
    /// Whether the scene before counted as uncertain.
    pub uncertain: bool,
    /// Ids of the people in the scene before, ascending.
    pub members: U32Array,
    /// The place that the robot has not left; absent before the first cycle.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub place: Option<Place>,
    /// The wider place that it has not left while it was patient; absent before the first cycle, and for a planner that
    /// never loses patience.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub region: Option<Place>,
    /// Since when the robot is impatient, robot clock, s.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub impatient_since: Option<f64>,
    /// Where something stands that only the driver sees, and since when the driver has not braked for it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unseen: Option<Place>,
    /// The trajectory being driven.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub previous: Option<Previous>,
    /// The driver's newest command; absent until one is heard.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub driven: Option<Twist>,
    /// Those of the generators; an empty one has nothing to go on with.
    pub trees: Vec<Tree>,
}

checks! { memory: Memory {
    robot: id;
    version: text;
    members: length(0, MAX_PEOPLE);
    members: ascending;
    place, region, unseen: optional(part);
    impatient_since: optional(number);
    previous: optional(part);
    driven: optional(part);
    trees: list(MAX_TREES, part);
}}

/// Somewhere that the robot came to.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Place {
    /// Map frame, m.
    pub x: f64,
    /// Map frame, m.
    pub y: f64,
    /// When it came there, robot clock, s.
    pub since: f64,
}

checks! { place: Place { x, y, since: number; } }

/// A trajectory that an earlier cycle has chosen.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Previous {
    /// Identifier of its candidate, in the cycle it comes from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub candidate: Option<u32>,
    /// Of its scene, robot clock, s.
    pub stamp: f64,
    /// How long after the stamp it may be followed, s.
    pub valid_for_s: f64,
    /// Between states, s.
    pub dt: f64,
    /// `[1 + K]` map frame, m: where the robot was at the stamp, then the states; number k (from 0) is due `k * dt`
    /// after the stamp.
    pub x: F64Array,
    /// `[1 + K]`, map frame, m.
    pub y: F64Array,
    /// `[1 + K]`, map frame, rad.
    pub heading: F64Array,
    /// `[1 + K]` forward speed at the stamp, then that which leads to each state, m/s.
    pub v: F64Array,
    /// `[1 + K]` turn rate at the stamp, then that which leads to each state, rad/s.
    pub omega: F64Array,
}

checks! { previous: Previous {
    stamp: number;
    valid_for_s: non_negative;
    dt: positive;
    x: length(1, MAX_STEPS);
    x, y, heading, v, omega: array(previous.x.len());
}}
