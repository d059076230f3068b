//! Scoring in the arbiter itself: its own terms always, and what no replica has scored.

use std::borrow::Cow;
use std::collections::BTreeSet;

use curionav_planning::arbitration::{Scores, total_costs};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::scene::Scene;

use curionav_pool::context::PlanContext;

/// Candidates scored in one go: what is done when time runs out is kept.
const CHUNK: usize = 16;

/// What is scored.
pub(crate) struct InProcess<'a> {
    pub(crate) context: &'a PlanContext,
    pub(crate) scene: &'a Scene,
    pub(crate) candidates: &'a CandidateSet,
}

impl InProcess<'_> {
    /// Scores what is missing of `terms` until `is_over`, and says under which of them it scored any candidate. Those
    /// that are the arbiter's own are never cut short, because no replica computes them. Of the others the most
    /// promising candidates come first, each under every term, so that what is done in time can be followed.
    pub(crate) fn score<'t>(
        &self,
        terms: &[&'t str],
        scores: &mut Scores,
        is_over: &dyn Fn() -> bool,
    ) -> BTreeSet<&'t str> {
        let (own, others): (Vec<&str>, Vec<&str>) = terms.iter().partition(|term| self.context.is_own(term));
        let all: Vec<usize> = (0..self.candidates.len()).collect();
        let mut scored = BTreeSet::new();
        for term in own {
            if self.score_some(term, &all, scores, &|| false) {
                scored.insert(term);
            }
        }
        if !self.context.in_process || others.is_empty() {
            return scored;
        }
        for chunk in self.most_promising_first(&others, scores).chunks(CHUNK) {
            for term in &others {
                if is_over() {
                    return scored;
                }
                if self.score_some(term, chunk, scores, is_over) {
                    scored.insert(term);
                }
            }
        }
        scored
    }

    /// Scores those of `indices` that `term` has not scored, and says whether there were any. Nothing is kept of an
    /// evaluation that is over before it ends.
    fn score_some(
        &self,
        term: &str,
        indices: &[usize],
        scores: &mut Scores,
        is_over: &dyn Fn() -> bool,
    ) -> bool {
        let Some(evaluator) = self.context.course.evaluator(term) else { return false };
        let missing: Vec<usize> =
            indices.iter().copied().filter(|&index| scores.cost(term, index).is_none()).collect();
        let wanted = if missing.iter().copied().eq(0..self.candidates.len()) {
            Cow::Borrowed(self.candidates)
        } else {
            Cow::Owned(self.candidates.pick(missing.iter().copied()))
        };
        match evaluator.evaluate(self.scene, &wanted, is_over) {
            Ok(costs) => {
                for (&index, cost) in missing.iter().zip(&costs) {
                    if let Err(error) = scores.insert(term, index, &[*cost]) {
                        tracing::error!(%error, "own scores not used");
                    }
                }
                !missing.is_empty()
            }
            Err(stopped) => {
                tracing::warn!(term, %stopped, "in-process evaluation ran out of time");
                false
            }
        }
    }

    /// All candidates, the one of least cost under the terms that are not `missing` first; those that lack one of these
    /// terms last.
    fn most_promising_first(&self, missing: &[&str], scores: &Scores) -> Vec<usize> {
        let mut profile = self.context.course.profile.clone();
        profile.terms.retain(|term, _| !missing.contains(&term.as_str()));
        let total = total_costs(&profile, self.scene, self.candidates.steps(), scores).total;
        let cost: Vec<f64> = total.into_iter().map(|total| total.unwrap_or(f64::INFINITY)).collect();
        let mut order: Vec<usize> = (0..self.candidates.len()).collect();
        order.sort_by(|&a, &b| cost[a].total_cmp(&cost[b]).then(a.cmp(&b)));
        order
    }
}
