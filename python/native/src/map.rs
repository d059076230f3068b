//! Maps as map_server has them.

use curionav_mission::convert;
use curionav_planning::occupancy::{MapYaml, load_map};
use curionav_planning::text::loose_text;
use curionav_schemas::Message;
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::refusal::invalid;

/// Bytes of the `occupancy_grid` of a description and its image.
#[pyfunction]
pub(crate) fn read_map<'py>(
    py: Python<'py>,
    description: &[u8],
    image: &[u8],
) -> PyResult<Bound<'py, PyBytes>> {
    let text = loose_text(description).map_err(|error| invalid("map", error))?;
    let yaml = MapYaml::parse(&text).map_err(|error| invalid("map", error))?;
    let grid = py.detach(|| load_map(&yaml, image)).map_err(|error| invalid("map", error))?;
    Ok(PyBytes::new(py, &convert::occupancy_grid_to_wire(&grid).encode()))
}
