//! What a cost may depend on besides the candidate itself.

use crate::check::{checks, non_negative, number, optional, part};
use crate::limits::MAX_OBSTACLE_CELLS;
use crate::{Belief, Frame, People, Refusal, U32Array};
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
    /// What stands around the robot and is on no map: runs of cells of the map, as pairs of the index of the first and
    /// how many there are, ascending and apart.
    #[serde(default, skip_serializing_if = "no_runs")]
    pub obstacles: U32Array,
    /// The least room that the way ahead leaves beside the robot, m, if that is little.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub passage_m: Option<f64>,
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
    passage_m: optional(number);
    people: |_: &str, people: &People| match people.frame {
        Frame::Map => Ok(()),
        Frame::Robot => Err(Refusal::WrongFrame.at("people.frame")),
    };
    obstacles: |_: &str, obstacles: &U32Array| are_runs(obstacles).map_err(|why| why.at("obstacles"));
}}

fn no_runs(obstacles: &U32Array) -> bool {
    obstacles.is_empty()
}

/// Whether these are pairs of runs, ascending and apart, and not too many.
fn are_runs(obstacles: &U32Array) -> Result<(), Refusal> {
    if !obstacles.len().is_multiple_of(2) {
        return Err(Refusal::invalid(format!("has {} numbers; give pairs", obstacles.len())));
    }
    let mut free_from = 0;
    let mut cells = 0;
    for run in obstacles.chunks_exact(2) {
        let first = u64::from(run[0]);
        let count = u64::from(run[1]);
        if first < free_from || count == 0 {
            return Err(Refusal::invalid("has runs that are empty, overlap, or do not ascend"));
        }
        free_from = first + count;
        cells += count;
    }
    if cells > MAX_OBSTACLE_CELLS as u64 {
        return Err(Refusal::invalid(format!("has {cells} cells; give {MAX_OBSTACLE_CELLS} at most")));
    }
    Ok(())
}
