//! Work over replicas: who generates, and how a batch is cut.
//!
//! A candidate's cost depends on the scene and on that candidate alone, so how the batch is cut and who
//! answers changes nothing about the result.

use std::collections::BTreeMap;
use std::ops::Range;
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;

use curionav_planning::generation::Generated;
use curionav_runtime::convert;
use curionav_runtime::locked::locked;
use curionav_runtime::query::AskError;
use curionav_schemas::{GenerateReply, Scores, keys};
use futures_util::StreamExt;
use futures_util::stream::FuturesUnordered;

use crate::ahead::{Ahead, Early};
use crate::budget::Budget;
use crate::parts::{part_of, shares};
use crate::peers::{Call, Peers};
use crate::pool::{Answer, Pool};
use crate::question::{EvaluateQuestion, EvaluateQuestions, GenerateQuestion};

/// What a generator has answered.
#[derive(Debug)]
pub struct Grown {
    /// Candidates and tree.
    pub generated: Generated,
    /// Whether the budget has cut its growth short, as
    /// [`PlanContext::generate`](crate::context::PlanContext::generate) says it.
    pub cut: bool,
    /// Whether it has asked all evaluators that it was to ask.
    pub forwarded: bool,
}

/// Asks generators until one gives candidates of the right shape for tree `index` of a cycle. The question is made once
/// it is known that one is there.
pub async fn generate<'a, P: Peers>(
    pool: &Pool<P>,
    robot: &str,
    question: impl FnOnce() -> GenerateQuestion<'a>,
    index: usize,
    shape: (usize, f64),
    budget: Budget,
) -> Option<Grown> {
    // Each tree has its own, which has prepared for the goal; any other takes over the tree, which travels with the
    // request.
    let preferred = {
        let mut replicas = pool.replicas();
        replicas.wake(pool.peers.now());
        replicas.preferred(keys::GENERATOR)
    };
    let first = preferred.get(index % preferred.len().max(1))?.clone();
    let question = &question();
    let ask = |instance: String, timeout: Duration| async move {
        let call = Call { instance: &instance, robot, timeout, clock: budget.clock };
        usable(pool.peers.generate(call, question).await?, &instance, question.id(), shape)
    };
    pool.first_answer(keys::GENERATOR, first, budget, ask).await
}

fn usable(
    reply: GenerateReply,
    instance: &str,
    (epoch, seq): (u64, u64),
    shape: (usize, f64),
) -> Result<Answer<Grown>, AskError> {
    let busy = Duration::from_micros(reply.elapsed_us);
    if (reply.epoch, reply.seq, reply.instance.as_str()) != (epoch, seq, instance) {
        return Err(AskError::Malformed("candidates of another cycle or replica".into()));
    }
    let candidates = convert::candidates(reply.candidates).map_err(|r| AskError::Malformed(r.to_string()))?;
    if (candidates.steps(), candidates.dt()) != shape {
        return Err(AskError::Malformed("candidates of another shape".into()));
    }
    let count = candidates.len();
    let generated = Generated { candidates, tree: convert::tree(reply.tree) };
    let value = Grown { generated, cut: reply.cut, forwarded: reply.forwarded };
    Ok(Answer { count, value, busy, ahead: None })
}

/// Scores of one shard.
#[derive(Debug)]
pub struct Shard {
    /// Which term.
    pub term: String,
    /// Which candidates.
    pub range: Range<usize>,
    /// Their costs, or nothing if no replica answered in time.
    pub cost: Option<Vec<f64>>,
    /// From the start of the stage to having it.
    pub elapsed: Duration,
}

/// Scores the candidates of `robot` that `questions` are about under each of `terms`, all shards at once. Some may
/// have been asked `ahead`, by the generator.
pub async fn evaluate<P: Peers>(
    pool: &Pool<P>,
    terms: &[String],
    robot: &str,
    questions: &EvaluateQuestions<'_>,
    budget: Budget,
    ahead: Ahead<'_>,
) -> Vec<Shard> {
    let count = questions.count();
    let started = pool.peers.now();
    pool.replicas().wake(started);
    pool.replicas().count_batch(count);
    let mut asked: BTreeMap<&str, Vec<Early<'_>>> = BTreeMap::new();
    for early in ahead.0 {
        asked.entry(&early.part.term).or_default().push(early);
    }
    let mut work = Vec::new();
    for term in terms {
        if let Some(asked) = asked.remove(term.as_str()) {
            for early in asked {
                let range = part_of(count, (early.part.start, early.part.end));
                if !range.is_empty() {
                    let (instance, index) = (early.part.instance.clone(), early.part.shard);
                    work.push((range.len() as f64, term, instance, index, range, Some(early)));
                }
            }
            continue;
        }
        let slots = pool.replicas().choose_slots(term, robot, count);
        let speeds: Vec<f64> = slots.iter().map(|slot| slot.speed).collect();
        for (index, (slot, share)) in slots.into_iter().zip(shares(&speeds)).enumerate() {
            let range = part_of(count, share);
            if !range.is_empty() {
                work.push((range.len() as f64 / slot.speed, term, slot.instance, index as u32, range, None));
            }
        }
    }
    // What takes longest goes first: questions leave one after the other.
    work.sort_by(|a, b| b.0.total_cmp(&a.0));
    let open = FuturesUnordered::new();
    for (_, term, first, index, range, early) in work {
        let question = questions.shard(term, index, range.clone());
        open.push(async move {
            let cost = evaluate_shard(pool, term, robot, (first, early), &question, budget).await;
            Shard { term: term.clone(), range, cost, elapsed: pool.peers.now() - started }
        });
    }
    let mut done: Vec<Shard> = open.collect().await;
    done.sort_by(|a, b| (&a.term, a.range.start).cmp(&(&b.term, b.range.start)));
    done
}

async fn evaluate_shard<P: Peers>(
    pool: &Pool<P>,
    term: &str,
    robot: &str,
    (first, early): (String, Option<Early<'_>>),
    question: &EvaluateQuestion<'_>,
    budget: Budget,
) -> Option<Vec<f64>> {
    let ahead = early.as_ref().map(|early| early.since);
    let (early, was_of_use) = (Mutex::new(early), AtomicBool::new(ahead.is_none()));
    let ask = |instance: String, timeout: Duration| {
        // The first that is to be asked has been.
        let (early, was_of_use) = (locked(&early).take(), &was_of_use);
        async move {
            let call = Call { instance: &instance, robot, timeout, clock: budget.clock };
            let ahead = early.as_ref().and(ahead);
            let scores = match early {
                Some(early) => early.answer().await?,
                None => pool.peers.evaluate(term, call, question).await?,
            };
            if !fits(&scores, question, term, &instance) {
                return Err(AskError::Malformed("scores are not for this shard".into()));
            }
            was_of_use.fetch_or(ahead.is_some(), Ordering::Relaxed);
            let busy = Duration::from_micros(scores.elapsed_us);
            Ok(Answer { count: scores.cost.len(), value: scores.cost.0, busy, ahead })
        }
    };
    let answer = pool.first_answer(term, first, budget, ask).await;
    if !was_of_use.into_inner() {
        pool.replicas().failed_ahead(term);
    }
    answer
}

fn fits(scores: &Scores, question: &EvaluateQuestion<'_>, term: &str, instance: &str) -> bool {
    (scores.epoch, scores.seq, scores.shard) == question.id()
        && (scores.term.as_str(), scores.instance.as_str()) == (term, instance)
        && scores.cost.len() == question.count()
}
