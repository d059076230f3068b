//! The arbiter: what it sees, what it remembers, and how a cycle begins and ends.

pub mod cycle;
pub mod decision_message;
pub mod memory;
pub mod obstacle_watch;
pub mod own_planner;
