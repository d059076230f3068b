//! What the localiser's belief is made of, for those who look on.

use crate::array::F32Array;
use crate::check::{array, checks, each, length, non_negative, number};
use crate::limits::MAX_PARTICLES;
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

checks! { particles: Particles {
    stamp: number;
    x: length(0, MAX_PARTICLES);
    x, y, heading, weight: array(particles.x.len());
    weight: each(non_negative);
}}
