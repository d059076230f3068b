//! Candidate trajectories as a structure of arrays.

use crate::array::{F64Array, U32Array};
use crate::check;
use crate::limits::{MAX_CANDIDATES, MAX_STEPS};
use crate::message::Validate;
use crate::reject::Reject;
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

impl Validate for CandidateSet {
    fn validate(&self) -> Result<(), Reject> {
        check::positive(&[("dt", self.dt)])?;
        // Bounded by the limits, the product cannot overflow.
        check::at_most("count", self.count as usize, MAX_CANDIDATES)?;
        check::one_to("steps", self.steps as usize, MAX_STEPS)?;
        check::length("id", self.id.len(), self.count as usize)?;
        check::arrays(
            self.count as usize * self.steps as usize,
            &[
                ("x", &self.x),
                ("y", &self.y),
                ("heading", &self.heading),
                ("v", &self.v),
                ("omega", &self.omega),
            ],
        )
    }
}
