//! The simulator: takes a scenario in, plays the world it describes, and measures how the robot did.
//!
//! To the other services it is a robot: it gives `scan`, `odom` and `people` and takes `cmd`.

mod crowd;
mod cycle_record;
mod inject;
mod record;
mod run;
mod service;

pub use inject::{Prepared, prepare};
pub use service::run;
