//! Many robots at 10 Hz on one pool, every service a process of its own behind a real router, and every five seconds
//! something fails.
//!
//! Simulated are the bases, what the localisers say, and people; trees are small, so that two cores are enough.
//! `CURIONAV_SOAK_S` is how many seconds it takes: 60 with eight robots unless it says otherwise, 1800 with twenty
//! for the long version.

mod account;
mod fault;
mod fleet;
mod hall_of_robots;
mod memory;
pub(crate) mod process;
mod robot;
mod watch;
