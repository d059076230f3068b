//! A scenario played to its end in one thread: no network, no session, no message that is encoded.
//!
//! [`play`] hands what the world shows to the localizer, its belief to the arbiter, the decision to the driver, and
//! the driver's command back to the world, tick by tick. Each role is that of `crates/robot`, so the decisions are the
//! same, bit for bit, as those of the services in lockstep. What the simulator has in common with it is here as well: a
//! scenario [made ready](prepare), [what the robot is told](sensed), and [how the run is judged](judge).

pub mod built_in;
mod cycle_record;
mod inject;
pub mod judge;
mod lockstep;
mod record;
pub mod robot;
pub mod sensed;

pub use inject::{Prepared, prepare};
pub use lockstep::{play, play_by, play_while};
