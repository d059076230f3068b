//! Many robots at 10 Hz on one pool, every service a process of its own behind a real router, and every five seconds
//! something fails.
//!
//! Simulated are the bases, what the localisers say, and people; trees are small, so that two cores are enough.
//! `CURIONAV_SOAK_S` is how many seconds it takes: 40 with eight robots unless it says otherwise, 1800 with twenty
//! for the long version. In the short one the robots' time passes more slowly where the machine cannot keep up
//! (`crate::pace`), and it takes longer.

mod fault;
mod fleet;
mod memory;
pub(crate) mod process;
mod robot;
mod run;
mod summary;
mod viewer;
mod watch;
