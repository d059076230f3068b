//! The order in which a generator offers its candidates, as a term: for planners that choose while they generate.

use crate::candidates::CandidateSet;
use crate::evaluation::{Costs, Evaluator, each};
use crate::scene::Scene;

/// Term `order`: the place of a candidate among all of its cycle, from 1 on, without unit. With no other term, the
/// first candidate that passes the final check is driven.
#[derive(Debug, Clone, Copy)]
pub struct OrderEvaluator;

impl Evaluator for OrderEvaluator {
    fn evaluate(&self, _: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        each(candidates, should_stop, |i| f64::from(candidates.id()[i]) + 1.0)
    }
}
