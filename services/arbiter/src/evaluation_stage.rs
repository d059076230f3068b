//! What a cycle's candidates cost: shards over every replica, and the rest in process.

use std::collections::BTreeMap;
use std::time::Duration;

use curionav_planning::arbitration::Scores;
use curionav_planning::candidates::CandidateSet;
use curionav_planning::scene::Scene;
use curionav_schemas::{self as wire, Degradation, Evaluated, TermTime};

use crate::in_process::InProcess;
use curionav_pool::budget::Budget;
use curionav_pool::context::PlanContext;
use curionav_pool::dispatch::{self, Shard};
use curionav_pool::peers::Peers;
use curionav_pool::pool::Pool;
use curionav_robot::arbiter::memory::DecisionId;

/// What came of the evaluation of a cycle's candidates.
pub(crate) struct EvaluationOutcome {
    /// The raw costs.
    pub(crate) scores: Scores,
    /// What evaluated each active term.
    pub(crate) evaluated: BTreeMap<String, Evaluated>,
    /// How long each took.
    pub(crate) times: Vec<TermTime>,
    /// What fell short.
    pub(crate) shortfalls: Vec<Degradation>,
}

/// Evaluates the candidates under every active term: shards over the pool, and in process what no replica has scored.
/// The cycle `id` began at `began`.
pub(crate) async fn evaluate<P: Peers>(
    pool: &Pool<P>,
    context: &PlanContext,
    id: DecisionId,
    began: Duration,
    scene: &Scene,
    scene_message: &wire::Scene,
    candidates: &CandidateSet,
) -> EvaluationOutcome {
    let active = context.course.profile.active_terms(scene.uncertain).map(|(term, _)| term.to_owned());
    let active: Vec<String> = active.collect();
    let started = pool.peers.now();
    let stage = Budget::of_evaluation(began, started, &context.mission);
    let questions = context.evaluate_questions(id, scene_message, candidates);
    let robot = &context.mission.order.robot;
    let of_pools = context.active_pool_terms(scene);
    let shards = dispatch::evaluate(pool, &of_pools, robot, &questions, stage).await;
    let (mut scores, mut times) = gather(candidates.len(), &shards);

    let missing: Vec<&str> =
        active.iter().map(String::as_str).filter(|term| !scores.missing(term).is_empty()).collect();
    let is_over = || stage.is_over(pool.peers.now());
    let own = InProcess { context, scene, candidates };
    let scored = pool.peers.compute(|| own.score(&missing, &mut scores, &is_over));
    let all = (pool.peers.now() - started).as_micros() as u64;
    times.extend(scored.iter().map(|term| ((*term).to_owned(), all)));
    let mut evaluated = BTreeMap::new();
    for term in &active {
        let is_own = scored.contains(term.as_str());
        let nothing = missing.contains(&term.as_str()) && scores.missing(term).len() == candidates.len();
        let how = if is_own {
            Evaluated::Local
        } else if nothing {
            Evaluated::None
        } else if context.is_own(term) {
            // Of no candidate at all.
            Evaluated::Local
        } else {
            Evaluated::Pool
        };
        evaluated.insert(term.clone(), how);
    }
    let times = times.into_iter().map(|(term, us)| TermTime { term, us }).collect();
    let shortfalls =
        evaluated.iter().filter_map(|(term, how)| shortfall(context, term, *how, &scores)).collect();
    EvaluationOutcome { scores, evaluated, times, shortfalls }
}

fn shortfall(context: &PlanContext, term: &str, how: Evaluated, scores: &Scores) -> Option<Degradation> {
    let name = term.to_owned();
    match how {
        Evaluated::Local if !context.is_own(term) => Some(Degradation::EvaluatedLocally { term: name }),
        Evaluated::None => Some(Degradation::NotEvaluated { term: name }),
        Evaluated::Pool if !scores.missing(term).is_empty() => {
            Some(Degradation::PartlyEvaluated { term: name })
        }
        _ => None,
    }
}

/// Puts the shards together.
fn gather(count: usize, shards: &[Shard]) -> (Scores, BTreeMap<String, u64>) {
    let mut scores = Scores::new(count);
    let mut times: BTreeMap<String, u64> = BTreeMap::new();
    for shard in shards {
        let Some(cost) = &shard.cost else { continue };
        match scores.insert(&shard.term, shard.range.start, cost) {
            Ok(0) => {}
            Ok(refused) => tracing::warn!(term = shard.term, refused, "values that are not costs"),
            Err(error) => tracing::warn!(%error, "shard not used"),
        }
        let time = times.entry(shard.term.clone()).or_default();
        *time = (*time).max(shard.elapsed.as_micros() as u64);
    }
    (scores, times)
}
