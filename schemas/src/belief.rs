//! Where the localiser believes the robot is, and the particles behind its belief.

use crate::array::{F32Array, F64Array};
use crate::check::{array, checks, covariance, each, fraction, length, non_negative, number, part};
use crate::limits::MAX_PARTICLES;
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantNames};

/// Whether a robot may act on the belief.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr, VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Confidence {
    /// The scans fit the map, and hardly any weight lies elsewhere.
    Sure,
    /// The robot may be elsewhere, or the map explains little of what the laser sees: it drives slowly.
    Doubtful,
    /// The robot is probably elsewhere: it follows no plan.
    Lost,
}

/// How far the belief can be trusted beyond its covariance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// The probability that the robot is not in the heaviest cluster, 0..1.
    pub outside_weight: f64,
    /// How well the scan fits the map at the mean, 0..1.
    pub scan_fit: f64,
    /// Particles in use.
    pub particles: u32,
    /// Whether a robot may act on it.
    pub confidence: Confidence,
}

checks! { health: Health {
    outside_weight, scan_fit: fraction;
}}

/// Mean of the heaviest cluster and the covariance about it, map frame, with the velocity odometry reports.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Belief {
    /// Tick of the streams this belongs to.
    pub tick: u64,
    /// Robot clock, s.
    pub stamp: f64,
    /// Map frame, m.
    pub x: f64,
    /// Map frame, m.
    pub y: f64,
    /// Map frame, rad.
    pub heading: f64,
    /// Covariance of (x, y, heading), row-major 3x3; m^2, m rad, rad^2. It is that of all places where the robot may be
    /// while more than 5 % of the weight lies outside the heaviest cluster.
    pub covariance: F64Array,
    /// Forward speed, m/s.
    pub v: f64,
    /// Turn rate, rad/s.
    pub omega: f64,
    /// How far to trust it.
    pub health: Health,
}

checks! { belief: Belief {
    stamp, x, y, heading, v, omega: number;
    covariance: covariance;
    health: part;
}}

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
