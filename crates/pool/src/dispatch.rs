//! Work over replicas: who generates, and how a batch is cut.
//!
//! A candidate's cost depends on the scene and on that candidate alone, so how the batch is cut and who
//! answers changes nothing about the result.

use std::ops::Range;
use std::time::Duration;

use curionav_planning::generation::Generated;
use curionav_runtime::convert;
use curionav_runtime::query::AskError;
use curionav_schemas::{GenerateReply, Scores, keys};
use futures_util::StreamExt;
use futures_util::stream::FuturesUnordered;

use crate::budget::Budget;
use crate::peers::{Call, Peers};
use crate::pool::{Answer, Pool};
use crate::question::{EvaluateQuestion, EvaluateQuestions, GenerateQuestion};

/// Asks generators until one gives candidates of the right shape for tree `index` of a cycle; also says whether the
/// budget has cut its growth short, as [`PlanContext::generate`](crate::context::PlanContext::generate) does.
pub async fn generate<P: Peers>(
    pool: &Pool<P>,
    robot: &str,
    question: &GenerateQuestion,
    index: usize,
    shape: (usize, f64),
    budget: Budget,
) -> Option<(Generated, bool)> {
    // Each tree has its own, which has prepared for the goal; any other takes over the tree, which travels with the
    // request.
    let preferred = {
        let mut replicas = pool.replicas();
        replicas.wake(pool.peers.now());
        replicas.preferred(keys::GENERATOR)
    };
    let first = preferred.get(index % preferred.len().max(1))?.clone();
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
) -> Result<Answer<(Generated, bool)>, AskError> {
    let busy = Duration::from_micros(reply.elapsed_us);
    if (reply.epoch, reply.seq, reply.instance.as_str()) != (epoch, seq, instance) {
        return Err(AskError::Malformed("candidates of another cycle or replica".into()));
    }
    let candidates = convert::candidates(reply.candidates).map_err(|r| AskError::Malformed(r.to_string()))?;
    if (candidates.steps(), candidates.dt()) != shape {
        return Err(AskError::Malformed("candidates of another shape".into()));
    }
    let count = candidates.len();
    let value = (Generated { candidates, tree: convert::tree(reply.tree) }, reply.cut);
    Ok(Answer { count, value, busy })
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

/// Scores the candidates of `robot` that `questions` are about under each of `terms`, all shards at once.
pub async fn evaluate<P: Peers>(
    pool: &Pool<P>,
    terms: &[String],
    robot: &str,
    questions: &EvaluateQuestions<'_>,
    budget: Budget,
) -> Vec<Shard> {
    let count = questions.count();
    let started = pool.peers.now();
    pool.replicas().wake(started);
    let mut work = Vec::new();
    for term in terms {
        let slots = pool.replicas().choose_slots(term, robot, count);
        let speeds: Vec<f64> = slots.iter().map(|slot| slot.speed).collect();
        for (index, (slot, range)) in slots.into_iter().zip(shards(count, &speeds)).enumerate() {
            if !range.is_empty() {
                work.push((range.len() as f64 / slot.speed, term, slot.instance, index as u32, range));
            }
        }
    }
    // What takes longest goes first: questions leave one after the other.
    work.sort_by(|a, b| b.0.total_cmp(&a.0));
    let open = FuturesUnordered::new();
    for (_, term, first, index, range) in work {
        let question = questions.shard(term, index, range.clone());
        open.push(async move {
            let cost = evaluate_shard(pool, term, robot, first, &question, budget).await;
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
    first: String,
    question: &EvaluateQuestion<'_>,
    budget: Budget,
) -> Option<Vec<f64>> {
    let ask = |instance: String, timeout: Duration| async move {
        let call = Call { instance: &instance, robot, timeout, clock: budget.clock };
        let scores = pool.peers.evaluate(term, call, question).await?;
        if !fits(&scores, question, term, &instance) {
            return Err(AskError::Malformed("scores are not for this shard".into()));
        }
        let busy = Duration::from_micros(scores.elapsed_us);
        Ok(Answer { count: scores.cost.len(), value: scores.cost.0, busy })
    };
    pool.first_answer(term, first, budget, ask).await
}

fn fits(scores: &Scores, question: &EvaluateQuestion<'_>, term: &str, instance: &str) -> bool {
    (scores.epoch, scores.seq, scores.shard) == question.id()
        && (scores.term.as_str(), scores.instance.as_str()) == (term, instance)
        && scores.cost.len() == question.count()
}

/// Contiguous ranges that cover `count` candidates, one per slot, proportional to its speed.
fn shards(count: usize, speeds: &[f64]) -> Vec<Range<usize>> {
    let total: f64 = speeds.iter().sum();
    let (mut covered, mut start) = (0.0, 0);
    let range = |(index, speed): (usize, &f64)| {
        covered += speed;
        let last = index + 1 == speeds.len();
        let end = if last { count } else { ((covered / total * count as f64).round() as usize).min(count) };
        std::mem::replace(&mut start, end)..end
    };
    speeds.iter().enumerate().map(range).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_cover_every_candidate_once_whatever_the_speeds() {
        for count in [1, 15, 16, 31, 100, 2000] {
            for slots in 1..9 {
                let speeds: Vec<f64> = (0..slots).map(|i| 1.0 + f64::from(i * i) * 7.3).collect();
                let all: Vec<usize> = shards(count, &speeds).into_iter().flatten().collect();
                assert_eq!(all, (0..count).collect::<Vec<_>>(), "{count} over {slots}");
            }
        }
    }

    #[test]
    fn a_shard_is_as_long_as_its_slot_is_fast() {
        assert_eq!(shards(100, &[1.0, 1.0, 1.0]), vec![0..33, 33..67, 67..100]);
        // 3 of 4 and 1 of 4
        assert_eq!(shards(100, &[300.0, 100.0]), vec![0..75, 75..100]);
    }
}
