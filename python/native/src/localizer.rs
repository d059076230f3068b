//! The localiser, scan by scan.

use curionav_mission::convert;
use curionav_planning::geometry::Pose2;
use curionav_planning::sensor;
use curionav_robot::localizer::{Localization, Start};
use curionav_schemas::{LaserModel, Message, Odometry, OdometryNoise, Scan, Value};
use nalgebra::Matrix3;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::fields::FIELDS;
use crate::refusal::{message, optional, part, refused};

/// Localizes one robot on one map.
#[pyclass]
pub(crate) struct Localizer {
    localization: Localization,
    laser: sensor::LaserModel,
}

#[pymethods]
impl Localizer {
    /// Map, laser, noise and parameters as bytes; where the robot is at first, with nine entries of its covariance.
    #[new]
    fn new(
        py: Python<'_>,
        map: &[u8],
        laser: Option<&[u8]>,
        noise: Option<&[u8]>,
        parameters: &[u8],
        start: ((f64, f64, f64), [f64; 9]),
        seed: u64,
    ) -> PyResult<Self> {
        let grid = convert::occupancy_grid(message("map", map)?).map_err(|reject| refused(&reject))?;
        let laser =
            optional::<LaserModel>("laser", laser)?.as_ref().map_or_else(Default::default, convert::laser);
        let noise = optional::<OdometryNoise>("odometry_noise", noise)?;
        let noise = noise.as_ref().map_or_else(Default::default, convert::noise);
        let parameters: Value = part("parameters", parameters)?;
        let localization = py.detach(|| {
            let params = convert::parameters("parameters", &parameters)?;
            let laser = convert::checked("laser", laser)?;
            let noise = convert::checked("odometry_noise", noise)?;
            let ((x, y, heading), covariance) = start;
            let pose = Pose2::new(x, y, heading);
            let covariance = Matrix3::from_row_slice(&covariance);
            let start = Start { pose, covariance, is_doubtful: false, seed };
            Localization::of(&FIELDS.insert(grid), laser, noise, params, &start)
        });
        let localization = localization.map_err(|reject| refused(&reject))?;
        Ok(Self { localization, laser })
    }

    /// The belief of a tick, as bytes.
    fn update<'py>(
        &mut self,
        py: Python<'py>,
        odometry: &[u8],
        scan: &[u8],
    ) -> PyResult<Bound<'py, PyBytes>> {
        let odometry: Odometry = message("odometry", odometry)?;
        let scan: Scan = message("scan", scan)?;
        let (belief, unused) = py.detach(|| self.localization.update(&odometry, Some(&scan), self.laser));
        match unused {
            Some(reject) => Err(refused(&reject)),
            None => Ok(PyBytes::new(py, &belief.encode())),
        }
    }
}
