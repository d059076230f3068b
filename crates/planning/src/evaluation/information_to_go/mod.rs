//! What a candidate's end is worth to a robot that will not always know where it is: information beyond the horizon.
//!
//! CPC looks as far as a candidate does. Where no landmark is in range, all candidates look alike to it and standing
//! costs least. This term adds what lies beyond: the metres by which the way to the goal is longer for a robot that is
//! as uncertain as it will be there ([`InformationToGoField`]). Where landmarks are always in view, it is flat and
//! changes nothing.

mod field;
mod roadmap;
mod uncertainty;

use std::sync::Arc;

use crate::candidates::CandidateSet;
use crate::evaluation::cpc::CpcEvaluator;
use crate::evaluation::{Costs, Evaluator};
use crate::scene::Scene;

pub use field::{InformationToGoField, InformationToGoParams};

/// Term `information-to-go`: [`InformationToGoField::at`] each state, under the covariance that CPC predicts there
/// (eqs. 10 and 11), summed over the states; metres.
#[derive(Debug, Clone)]
pub struct InformationToGoEvaluator {
    /// What lies beyond.
    pub field: Arc<InformationToGoField>,
    /// What predicts the covariances.
    pub cpc: CpcEvaluator,
}

impl Evaluator for InformationToGoEvaluator {
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        let mut costs = vec![0.0; candidates.len()];
        self.cpc.along(&scene.belief.covariance, candidates, should_stop, |i, sigmas| {
            let states = candidates.range(i).map(|at| candidates.all_states().position(at));
            costs[i] = states.zip(sigmas).map(|(p, sigma)| self.field.at(p, sigma)).sum();
        })?;
        Ok(costs)
    }
}

#[cfg(test)]
mod tests;
