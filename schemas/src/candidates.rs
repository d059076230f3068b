//! Candidate trajectories as a structure of arrays.

use crate::check::{array, checks, count, exactly, optional, positive};
use crate::limits::{MAX_CANDIDATES, MAX_STEPS};
use crate::{F64Array, TypedSlice, U32Array};
use serde::{Deserialize, Serialize};

/// `count` trajectories of `steps` states; state k (from 0) is `(k + 1) * dt` after the scene's stamp. Every array is
/// `[count, steps]`, row-major, map frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CandidateSet {
    /// How many candidates there are.
    pub count: u32,
    /// States of each candidate.
    pub steps: u32,
    /// Time between states, s.
    pub dt: f64,
    /// `[count]` identifiers; of equal costs the lower wins.
    pub id: U32Array,
    /// x of each state, m.
    pub x: F64Array,
    /// y of each state, m.
    pub y: F64Array,
    /// Heading of each state, rad.
    pub heading: F64Array,
    /// Forward speed that led to the state, m/s.
    pub v: F64Array,
    /// Turn rate that led to the state, rad/s.
    pub omega: F64Array,
}

// Bounded by the limits, the product of count and steps cannot overflow.
checks! { set: CandidateSet {
    dt: positive;
    count: count(0, MAX_CANDIDATES);
    steps: count(1, MAX_STEPS);
    id: exactly(set.count as usize);
    x, y, heading, v, omega: array(set.count as usize * set.steps as usize);
}}

/// Candidates that a term is to score: as a [`CandidateSet`], but columns that the term does not read may be absent.
///
/// A reader has arrays of its own; a writer may borrow them ([`CandidateShardSlices`]).
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CandidateShard<Ids = U32Array, Column = F64Array> {
    /// How many candidates there are.
    pub count: u32,
    /// States of each candidate.
    pub steps: u32,
    /// Time between states, s.
    pub dt: f64,
    /// `[count]` identifiers.
    pub id: Ids,
    /// x of each state, m.
    pub x: Column,
    /// y of each state, m.
    pub y: Column,
    /// Heading of each state, rad.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub heading: Option<Column>,
    /// Forward speed that led to the state, m/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub v: Option<Column>,
    /// Turn rate that led to the state, rad/s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub omega: Option<Column>,
}

/// Candidates as they are written.
pub type CandidateShardSlices<'a> = CandidateShard<TypedSlice<'a, u32>, TypedSlice<'a, f64>>;

checks! { shard: CandidateShard {
    dt: positive;
    count: count(0, MAX_CANDIDATES);
    steps: count(1, MAX_STEPS);
    id: exactly(shard.count as usize);
    x, y: array(shard.count as usize * shard.steps as usize);
    heading, v, omega: optional(array(shard.count as usize * shard.steps as usize));
}}

impl From<CandidateSet> for CandidateShard {
    fn from(set: CandidateSet) -> Self {
        let CandidateSet { count, steps, dt, id, x, y, heading, v, omega } = set;
        Self { count, steps, dt, id, x, y, heading: Some(heading), v: Some(v), omega: Some(omega) }
    }
}
