//! Candidate trajectories as a structure of arrays.

use crate::check::{array, checks, count, exactly, positive};
use crate::limits::{MAX_CANDIDATES, MAX_STEPS};
use crate::{F64Array, U32Array};
use serde::{Deserialize, Serialize};

/// `count` trajectories of `steps` states; state k (from 0) is `(k + 1) * dt` after the scene's stamp. Every array is
/// `[count, steps]`, row-major, map frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CandidateSet {
    /// Candidates.
    pub count: u32,
    /// States a candidate.
    pub steps: u32,
    /// Between states, s.
    pub dt: f64,
    /// `[count]` identifiers; of equal costs the lower wins.
    pub id: U32Array,
    /// Metres.
    pub x: F64Array,
    /// Metres.
    pub y: F64Array,
    /// Radians.
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
