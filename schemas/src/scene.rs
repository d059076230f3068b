//! What a cost may depend on besides the candidate itself.

use crate::check::{checks, non_negative, number, part};
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
    /// For how long the robot has not left the place where it is, s; the profile says how far away another place is.
    pub in_place_s: f64,
    /// Whether the robot has stayed where it is for so long that terms which give way count less.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub impatient: bool,
}

checks! { scene: Scene {
    stamp: number;
    belief: part;
    people: part;
    in_place_s: non_negative;
    people: |_: &str, people: &People| match people.frame {
        Frame::Map => Ok(()),
        Frame::Robot => Err(Refusal::WrongFrame.at("people.frame")),
    };
}}
