//! Recordings: MCAP files that hold every message of a robot as it was sent, and beside it what Foxglove and Rerun
//! can draw of it. [`Recorder`] writes them, [`Reader`] reads them back, [`recover`] makes a killed or damaged one
//! whole, and [`replay`] plans their cycles again.
//!
//! A message of the contract stands on a topic that is its Zenoh key, in CBOR, with the CDDL as its schema; see
//! `docs/recording.md`. Nothing that is read back comes from the pictures.

mod foxglove_messages;
mod read;
mod recorder;
mod recover;
pub mod replay;
mod scene_update;
mod timeline;
mod visible;
mod writer;

pub use read::{Item, Reader};
pub use recorder::{Recorder, Scope, Tally, Worlds};
pub use recover::{Damage, Recovery, recover};

pub(crate) const MESSAGE_ENCODING: &str = "cbor";
