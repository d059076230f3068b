//! What Python is told when something is refused: the message that a service would answer with.

use curionav_schemas::{Message, MissionEnd, Refusal, Reject, RunState, RunStatus};
use pyo3::create_exception;
use pyo3::exceptions::PyException;
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use serde::de::DeserializeOwned;

create_exception!(curionav_native, Refused, PyException, "Bytes of a `reject`.");
create_exception!(
    curionav_native,
    Ended,
    PyException,
    "Bytes of the `run_status` of a run without a result."
);

/// Raises a refusal.
pub(crate) fn refused(reject: &Reject) -> PyErr {
    let bytes = reject.encode();
    Python::attach(|py| Refused::new_err(PyBytes::new(py, &bytes).unbind()))
}

/// Raises what is wrong with an argument of this name.
pub(crate) fn invalid(field: &str, problem: impl ToString) -> PyErr {
    refused(&Refusal::invalid(problem).at(field))
}

/// Raises how a mission ended that has no result.
pub(crate) fn ended(end: MissionEnd) -> PyErr {
    let status = RunStatus {
        run: 0,
        world: "in-process".to_owned(),
        state: RunState::Failed,
        tick: 0,
        time_s: 0.0,
        distance_to_goal: 0.0,
        error: Some(end),
        result: None,
    };
    let bytes = status.encode();
    Python::attach(|py| Ended::new_err(PyBytes::new(py, &bytes).unbind()))
}

/// A value that is no message of its own, if it is given.
pub(crate) fn optional<T: DeserializeOwned>(field: &str, bytes: Option<&[u8]>) -> PyResult<Option<T>> {
    bytes.map(|bytes| part(field, bytes)).transpose()
}

/// A value that is no message of its own, such as a model or parameters.
pub(crate) fn part<T: DeserializeOwned>(field: &str, bytes: &[u8]) -> PyResult<T> {
    ciborium::from_reader(bytes).map_err(|error| invalid(field, error))
}

/// A message that Python has made.
pub(crate) fn message<M: Message>(field: &str, bytes: &[u8]) -> PyResult<M> {
    let at = |reject: Reject| if field.is_empty() { reject } else { reject.within(field) };
    M::decode(bytes, None).map_err(|reject| refused(&at(reject)))
}
