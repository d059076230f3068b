//! Where the localiser believes the robot is.

use crate::array::F64Array;
use crate::check::{checks, covariance, fraction, number, part};
use serde::{Deserialize, Serialize};

/// How far the belief can be trusted beyond its covariance.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Health {
    /// Share of particle weight outside the heaviest cluster, 0..1.
    pub outside_weight: f64,
    /// How well the scan fits the map at the mean, 0..1.
    pub scan_fit: f64,
    /// Particles in use.
    pub particles: u32,
    /// Whether the particles form one cluster.
    pub converged: bool,
}

checks! { health: Health {
    outside_weight, scan_fit: fraction;
}}

/// Mean and covariance of the heaviest cluster, map frame, with the velocity odometry reports.
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
    /// Covariance of (x, y, heading), row-major 3x3; m^2, m rad, rad^2.
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
