//! The program as a user runs it: `curionav` in its own process, judged by what it prints.

mod admission;
mod bad_input;
mod bench;
mod closed_output;
mod deaf_viewers;
mod deployment;
mod doctor;
mod doors;
mod drivers;
mod localize;
mod metrics;
mod narrow;
mod obstacles;
pub(crate) mod program;
mod real_inputs;
mod recording;
mod renewal;
mod rights;
mod scale;
mod scenarios;
mod secure;
mod signals;
mod slow_router;
mod strangers;
mod tracked;
mod two_routers;
mod zones;
