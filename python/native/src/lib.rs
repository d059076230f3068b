//! The extension module `curionav_native`: what the Python package does in process.
//!
//! The package wraps it (`python/src/curionav/in_process.py`); users do not import it. Messages cross as CBOR, as they
//! do on the wire, so that both sides check them alike. Arrays of the simulated world cross as NumPy arrays, which
//! take over the memory. Python's lock is not held while anything is computed.

mod episode;
mod fields;
mod localizer;
mod map;
mod people_tracker;
mod planner;
mod refusal;
mod run;
mod world;
mod worlds;

use pyo3::prelude::*;

/// The extension module.
#[pymodule(gil_used = false)]
mod curionav_native {
    #[pymodule_export]
    use super::localizer::Localizer;
    #[pymodule_export]
    use super::map::read_map;
    #[pymodule_export]
    use super::people_tracker::PeopleTracker;
    #[pymodule_export]
    use super::planner::Planner;
    #[pymodule_export]
    use super::refusal::{Ended, Refused};
    #[pymodule_export]
    use super::run::run;
    #[pymodule_export]
    use super::world::{Observation, World};
    #[pymodule_export]
    use super::worlds::Worlds;
}
