//! What a candidate costs: one evaluator per term. Most terms are in the modules of their names. The term `cnc` is in
//! [`hccdm`], the map that it is computed from, and `doppler` in [`human_space`]. [`crate::terms`] is the registry of
//! terms.
//!
//! The contract that everything depends on: the cost of a candidate depends on the evaluator, the scene and that
//! candidate, never on the other candidates of the batch. An evaluator is made from map, goal, laser and parameters.
//! So a batch can be split into shards over any number of replicas with the same result, bit for bit.

pub mod collision_risk;
pub mod cpc;
pub mod distance;
pub mod enclosing_circle;
pub mod hccdm;
mod hccdm_simd;
pub mod human_space;
pub mod information_to_go;
pub mod order;
pub mod risk;
pub mod uncertainty;

#[cfg(test)]
mod crowd_hull_tests;
#[cfg(test)]
mod dispatch_tests;

use crate::candidates::CandidateSet;
use crate::scene::Scene;

/// The evaluation was told to stop before it was done: its budget is spent.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
#[error("stopped before every candidate was scored")]
pub struct Stopped;

/// Raw cost of each candidate, in the term's own unit, lower is better, finite and not negative.
pub type Costs = Result<Vec<f64>, Stopped>;

/// Scores candidates under one term. The arbiter and the services use the same code, so the costs are the same.
pub trait Evaluator: Send + Sync {
    /// The cost of each candidate. `should_stop` is asked every few candidates.
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs;
}

/// One through the `saturation` s by which a number x counts as x / (1 + x / s); 0 without one, which is written 0.
fn temper(saturation: f64) -> f64 {
    if saturation > 0.0 { 1.0 / saturation } else { 0.0 }
}

/// Calls `cost` with the index of each candidate. If it is told to stop, it gives no costs.
pub fn each(
    candidates: &CandidateSet,
    should_stop: &dyn Fn() -> bool,
    mut cost: impl FnMut(usize) -> f64,
) -> Costs {
    let mut costs = Vec::with_capacity(candidates.len());
    for i in 0..candidates.len() {
        if should_stop() {
            return Err(Stopped);
        }
        costs.push(cost(i));
    }
    Ok(costs)
}
