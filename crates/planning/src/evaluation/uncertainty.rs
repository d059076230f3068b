//! The uncertainty of the paper's reference 15 as a term, inferred: how little the robot will know of its pose.

use crate::candidates::CandidateSet;
use crate::evaluation::cpc::CpcEvaluator;
use crate::evaluation::{Costs, Evaluator};
use crate::scene::Scene;

/// Term `uncertainty`: the mean of tr Sigma_k over a candidate's states (eqs. 10 and 11), m2 + rad2. It is `cpc`
/// without the wander Lambda of the estimate.
#[derive(Debug, Clone)]
pub struct UncertaintyEvaluator {
    /// What predicts Sigma.
    pub cpc: CpcEvaluator,
}

impl Evaluator for UncertaintyEvaluator {
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        let mut costs = vec![0.0; candidates.len()];
        self.cpc.along(&scene.belief.covariance, candidates, should_stop, |i, sigmas| {
            let sum: f64 = sigmas.iter().map(|sigma| sigma.trace().max(0.0)).sum();
            costs[i] = sum / sigmas.len().max(1) as f64;
        })?;
        Ok(costs)
    }
}
