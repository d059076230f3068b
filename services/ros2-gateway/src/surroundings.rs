//! The nearest thing in each direction from a place, as a scan.

use std::f64::consts::{PI, TAU};

use curionav_planning::beam::Beam;
use curionav_planning::numerics::atan2;
use curionav_schemas::{Pose, Scan, Validate};

use crate::fault::Fault;

/// Directions that are told apart: at 4 m they are 3.5 cm apart.
pub(crate) const DIRECTIONS: usize = 720;

/// How far the nearest thing in each direction is, metres; infinite where nothing is known.
pub(crate) struct Surroundings {
    nearest: Vec<f64>,
}

impl Surroundings {
    /// Nothing is known.
    pub(crate) fn unknown() -> Self {
        Self { nearest: vec![f64::INFINITY; DIRECTIONS] }
    }

    /// Something is so far ahead and to the left, metres.
    pub(crate) fn add(&mut self, ahead: f64, left: f64) {
        let place = (atan2(left, ahead) + PI) / TAU * DIRECTIONS as f64;
        let direction = (place.max(0.0) as usize).min(DIRECTIONS - 1);
        self.nearest[direction] = self.nearest[direction].min((ahead * ahead + left * left).sqrt());
    }

    /// The scan from a place `x`, `y` in the robot's frame, metres, of what is nearer than `most` metres.
    pub(crate) fn scan(self, x: f64, y: f64, most: f64) -> Result<Scan, Fault> {
        checked(Scan {
            tick: 0,
            stamp: 0.0,
            angle_min: 0.5 * TAU / DIRECTIONS as f64 - PI,
            angle_increment: TAU / DIRECTIONS as f64,
            range_min: None,
            range_max: most,
            laser: Pose { x, y, heading: 0.0 },
            ranges: self.nearest.iter().map(|metres| beam(*metres, most).range()).collect(),
        })
    }
}

/// Something so far away, or nothing as far as `most`; of what is infinitely far away nothing is known.
pub(crate) fn beam(metres: f64, most: f64) -> Beam {
    match metres {
        f64::INFINITY => Beam::Silent,
        metres if metres >= most => Beam::Free(most),
        metres => Beam::Obstacle(metres.max(1e-3)),
    }
}

pub(crate) fn checked(scan: Scan) -> Result<Scan, Fault> {
    scan.validate().map_err(|reject| Fault::unusable(reject.to_string()))?;
    Ok(scan)
}
