//! Scoring in the arbiter itself: local terms always, and what no replica has scored.

use std::borrow::Cow;
use std::collections::BTreeSet;

use curionav_planning::arbitration::{Scores, total_costs};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::scene::Scene;

use curionav_pool::context::PlanContext;

/// Candidates scored in one go: what is done when time runs out is kept.
const CHUNK: usize = 16;

/// Scores what is missing of `terms_to_score` until `is_over`, and says under which of them it scored any candidate.
/// Those that are the arbiter's own are never cut short, because no replica computes them. Of the others the most promising
/// candidates come first, each under every term, so that what is done in time can be followed.
pub(crate) fn score<'a>(
    context: &PlanContext,
    scene: &Scene,
    candidates: &CandidateSet,
    terms_to_score: &[&'a str],
    scores: &mut Scores,
    is_over: &dyn Fn() -> bool,
) -> BTreeSet<&'a str> {
    // Scores those of `indices` that `term` has not scored; whether any were.
    let score_some = |term: &str, indices: &[usize], scores: &mut Scores, is_over: &dyn Fn() -> bool| {
        let Some(evaluator) = context.course.evaluator(term) else { return false };
        let is_missing = |i: &usize| scores.cost(term, *i).is_none();
        let missing: Vec<usize> = indices.iter().copied().filter(is_missing).collect();
        let wanted = if missing.iter().copied().eq(0..candidates.len()) {
            Cow::Borrowed(candidates)
        } else {
            Cow::Owned(candidates.pick(missing.iter().copied()))
        };
        match evaluator.evaluate(scene, &wanted, is_over) {
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
    };
    let (local, others): (Vec<&str>, Vec<&str>) =
        terms_to_score.iter().partition(|term| context.is_own(term));
    let all: Vec<usize> = (0..candidates.len()).collect();
    let mut scored: BTreeSet<&str> =
        local.into_iter().filter(|term| score_some(term, &all, scores, &|| false)).collect();
    if !context.in_process || others.is_empty() {
        return scored;
    }
    for chunk in promising(context, scene, candidates, &others, scores).chunks(CHUNK) {
        for term in &others {
            if is_over() {
                return scored;
            }
            if score_some(term, chunk, scores, is_over) {
                scored.insert(term);
            }
        }
    }
    scored
}

/// All candidates, the one of least cost under the other terms first; those that lack one of these last.
fn promising(
    context: &PlanContext,
    scene: &Scene,
    candidates: &CandidateSet,
    missing: &[&str],
    scores: &Scores,
) -> Vec<usize> {
    let mut profile = context.course.profile.clone();
    profile.terms.retain(|term, _| !missing.contains(&term.as_str()));
    let total = total_costs(&profile, scene, candidates.steps(), scores).total;
    let cost = |i: usize| total.get(i).copied().flatten().unwrap_or(f64::INFINITY);
    let mut order: Vec<usize> = (0..candidates.len()).collect();
    order.sort_by(|&a, &b| cost(a).total_cmp(&cost(b)).then(a.cmp(&b)));
    order
}
