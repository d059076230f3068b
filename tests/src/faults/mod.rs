//! The arbiter's cycle, the pool's replicas and the driver in a network and a time that a seed decides.
//!
//! The cycle, the evaluators, the generator, the queues of the replicas, and what the driver obeys and commands
//! are the real ones. Simulated are the network, processes that come, hang and go, the localiser and the base.

mod arbiter;
pub(crate) mod base;
pub(crate) mod corridor_map;
mod degraded_modes;
mod epochs;
mod executor;
mod fault;
mod invariants;
mod lockstep;
mod many_goals;
mod overload;
mod readiness;
mod replica;
pub(crate) mod robot;
mod ten_thousand_cycles;
mod too_many;
mod world;
