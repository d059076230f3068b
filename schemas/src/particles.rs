//! What the localiser's belief is made of, for those who look on.

use crate::array::F32Array;
use crate::check;
use crate::limits::MAX_PARTICLES;
use crate::message::Validate;
use crate::reject::Reject;
use serde::{Deserialize, Serialize};

/// Poses the robot may have, map frame; arrays have one entry a particle. Nothing is decided by it.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Particles {
    /// Tick of the streams this belongs to.
    pub tick: u64,
    /// Robot clock, s.
    pub stamp: f64,
    /// Metres.
    pub x: F32Array,
    /// Metres.
    pub y: F32Array,
    /// Radians.
    pub heading: F32Array,
    /// Not negative: how likely each is beside the others.
    pub weight: F32Array,
}

impl Validate for Particles {
    fn validate(&self) -> Result<(), Reject> {
        check::numbers(&[("stamp", self.stamp)])?;
        let count = self.x.len();
        check::at_most("x", count, MAX_PARTICLES)?;
        let parts = [("x", &self.x), ("y", &self.y), ("heading", &self.heading), ("weight", &self.weight)];
        parts.into_iter().try_for_each(|(field, array)| check::array_f32(field, array, count))?;
        match self.weight.iter().position(|weight| *weight < 0.0) {
            Some(index) => {
                check::non_negative(&[(&format!("weight[{index}]"), f64::from(self.weight[index]))])
            }
            None => Ok(()),
        }
    }
}
