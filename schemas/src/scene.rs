//! What a cost may depend on besides the candidate itself.

use crate::check::{checks, number, part};
use crate::{Belief, Frame, People, Refusal};
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

checks! { scene: Scene {
    stamp: number;
    belief: part;
    people: part;
    people: |_: &str, people: &People| match people.frame {
        Frame::Map => Ok(()),
        Frame::Robot => Err(Refusal::WrongFrame.at("people.frame")),
    };
}}
