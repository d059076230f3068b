//! Planners of one's own: a program in any language is asked in each cycle what the robot could do.
//!
//! [`source`] says how such a planner is named and started, `lines` what is written on its standard input and read from
//! its standard output, `process` how it is asked without waiting for ever. [`attended`] is what robots ask: it makes
//! candidates of the answers, and counts what went wrong. `docs/own-planner.md` describes the protocol for those who
//! write a planner.

pub mod attended;
mod description;
mod lines;
mod process;
pub mod source;

pub use attended::{Attended, Run};
pub use description::{Check, Description};
pub use lines::ScanView;
pub use source::Source;
