//! Driver, arbiter and localizer as they run, in one process on a session without a network: what they make of missions
//! and of a base whose clock begins anew.

mod base;
mod begins_anew;
mod goals;
mod hostile;
mod localizers;
mod missions;
mod test_bench;
