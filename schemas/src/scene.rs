//! What a cost may depend on besides the candidate itself.

use crate::belief::Belief;
use crate::check;
use crate::message::Validate;
use crate::reject::{Refusal, Reject};
use crate::sensing::{Frame, People};
use serde::{Deserialize, Serialize};

/// One moment as the planner sees it: the belief, and the people in the map frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Scene {
    /// Tick of the belief.
    pub tick: u64,
    /// Robot clock, s.
    pub stamp: f64,
    /// Where the robot believes it is.
    pub belief: Belief,
    /// The people, in the map frame.
    pub people: People,
    /// Whether localisation counts as uncertain (with hysteresis): the terms conditional on it apply.
    pub uncertain: bool,
}

impl Validate for Scene {
    fn validate(&self) -> Result<(), Reject> {
        check::numbers(&[("stamp", self.stamp)])?;
        check::part("belief", &self.belief)?;
        check::part("people", &self.people)?;
        match self.people.frame {
            Frame::Map => Ok(()),
            Frame::Robot => Err(Refusal::WrongFrame.at("people.frame")),
        }
    }
}
