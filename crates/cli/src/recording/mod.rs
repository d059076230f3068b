//! Recordings: MCAP files that hold every message of a robot as it was sent, and beside them what Foxglove and Rerun
//! can draw.
//!
//! A message of the contract stands on a topic that is its Zenoh key, in CBOR, with the CDDL as its schema; see
//! `docs/recording.md`. Nothing that is read back comes from the pictures.

mod foxglove_messages;
mod read;
mod recorder;
mod recover;
mod scene_update;
mod timeline;
mod visible;
mod writer;

pub(crate) use read::{Item, Reader};
pub(crate) use recorder::{Recorder, Scope, Tally};
pub(crate) use recover::recover;

/// Schema encoding of our messages.
const SCHEMA_ENCODING: &str = "cddl";
/// Message encoding of our messages.
const MESSAGE_ENCODING: &str = "cbor";
