//! What the arbiter carries from one cycle into the next.

use crate::array::{F64Array, U32Array};
use crate::check;
use crate::decision::Twist;
use crate::limits::{MAX_PEOPLE, MAX_STEPS, MAX_TREES};
use crate::message::Validate;
use crate::reject::{Refusal, Reject};
use crate::tree::Tree;
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
    /// The trajectory being driven.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub previous: Option<Previous>,
    /// The driver's newest command; absent until one is heard.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub driven: Option<Twist>,
    /// Those of the generators; one without nodes is not yet grown.
    pub trees: Vec<Tree>,
}

impl Validate for Memory {
    fn validate(&self) -> Result<(), Reject> {
        check::id("robot", &self.robot)?;
        check::text("version", &self.version)?;
        check::at_most("members", self.members.len(), MAX_PEOPLE)?;
        if !self.members.is_sorted_by(|a, b| a < b) {
            return Err(Refusal::NotAscending.at("members"));
        }
        if let Some(previous) = &self.previous {
            check::part("previous", previous)?;
        }
        if let Some(driven) = &self.driven {
            check::part("driven", driven)?;
        }
        check::at_most("trees", self.trees.len(), MAX_TREES)?;
        self.trees.iter().try_for_each(|tree| check::part("trees", tree))
    }
}

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

impl Validate for Previous {
    fn validate(&self) -> Result<(), Reject> {
        let states = [&self.x, &self.y, &self.heading, &self.v, &self.omega];
        check::trajectory(self.stamp, self.valid_for_s, self.dt, states)?;
        check::one_to("x", self.x.len(), MAX_STEPS)
    }
}
