//! The tracker of people, scan by scan.

use curionav_mission::convert;
use curionav_robot::tracker::PeopleTracking;
use curionav_schemas::{Belief, Message, Odometry, OdometryNoise, Scan, Value};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::fields::FIELDS;
use crate::refusal::{message, optional, part, refused};

/// Tracks the people around one robot on one map.
#[pyclass]
pub(crate) struct PeopleTracker {
    tracking: PeopleTracking,
    range_sigma: f64,
}

#[pymethods]
impl PeopleTracker {
    /// Map, noise and parameters as bytes; the standard deviation of a range in metres.
    #[new]
    fn new(
        py: Python<'_>,
        map: &[u8],
        noise: Option<&[u8]>,
        parameters: &[u8],
        range_sigma: f64,
    ) -> PyResult<Self> {
        let grid = convert::occupancy_grid(message("map", map)?).map_err(|reject| refused(&reject))?;
        let noise = optional::<OdometryNoise>("odometry_noise", noise)?;
        let noise = noise.as_ref().map_or_else(Default::default, convert::noise);
        let parameters: Value = part("parameters", parameters)?;
        let tracking = py.detach(|| {
            let params = convert::parameters("parameters", &parameters)?;
            let noise = convert::checked("odometry_noise", noise)?;
            Ok(PeopleTracking::of(FIELDS.insert(grid), params, noise))
        });
        Ok(Self { tracking: tracking.map_err(|reject| refused(&reject))?, range_sigma })
    }

    /// The people that a scan shows to a robot that believes so, as bytes.
    fn update<'py>(
        &mut self,
        py: Python<'py>,
        odometry: &[u8],
        scan: &[u8],
        belief: &[u8],
    ) -> PyResult<Bound<'py, PyBytes>> {
        let odometry: Odometry = message("odometry", odometry)?;
        let scan: Scan = message("scan", scan)?;
        let belief: Belief = message("belief", belief)?;
        let people = py.detach(|| self.tracking.update(&odometry, &scan, &belief, self.range_sigma));
        let people = people.map_err(|reject| refused(&reject))?;
        Ok(PyBytes::new(py, &people.encode()))
    }
}
