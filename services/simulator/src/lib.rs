//! The simulator: takes a scenario in, plays the world it describes, and measures how the robot did.
//!
//! To the other services it is a robot: it gives `scan`, `odom` and `people` and takes `cmd`.

mod crowd;
mod run;
mod service;

pub use service::run;
