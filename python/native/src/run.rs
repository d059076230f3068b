//! A scenario played to its end.

use curionav_in_process::{play_while, prepare};
use curionav_schemas::{InjectRequest, Message, encode};
use pyo3::prelude::*;
use pyo3::types::PyBytes;

use crate::fields::FIELDS;
use crate::refusal::{ended, message, refused};

/// Ticks between two looks at whether Python has been interrupted: a fraction of a second.
const LOOK_EVERY: u64 = 16;

/// Bytes of `run_result`, `mission_order` and `occupancy_grid`.
type Played<'py> = (Bound<'py, PyBytes>, Bound<'py, PyBytes>, Bound<'py, PyBytes>);

/// Plays the scenario of an `inject_request`; gives the result, what the robot was told to do, and its map.
#[pyfunction]
pub(crate) fn run<'py>(py: Python<'py>, request: &[u8]) -> PyResult<Played<'py>> {
    let request: InjectRequest = message("", request)?;
    let mut interrupted = None;
    let played: PyResult<_> = py.detach(|| {
        let prepared = prepare(&request, "robot", &FIELDS).map_err(|reject| refused(&reject))?;
        let (order, map) = (encode(&prepared.order), prepared.map.encode());
        let mut ticks = 0;
        let mut goes_on = || {
            ticks += 1;
            if ticks % LOOK_EVERY == 0 {
                interrupted = Python::attach(|py| py.check_signals()).err();
            }
            interrupted.is_none()
        };
        let result = play_while(prepared, &FIELDS, &mut goes_on);
        Ok((result, order, map))
    });
    if let Some(error) = interrupted {
        return Err(error);
    }
    let (result, order, map) = played?;
    let result = result.map_err(|end| ended(*end))?;
    Ok((PyBytes::new(py, &result.encode()), PyBytes::new(py, &order), PyBytes::new(py, &map)))
}
