//! Bytes that are not ours, on every key, while a robot drives.
//!
//! `CURIONAV_SOAK_S` makes it longer than in a usual run of the tests: as many seconds, 60 at most.

pub(crate) mod ceilings;
mod flood;
mod impostor;
mod spoilt;
mod target;
pub(crate) mod viewer;
