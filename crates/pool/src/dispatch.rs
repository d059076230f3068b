//! Work over replicas: who generates, and how a batch is split.
//!
//! A candidate's cost depends on the scene and on that candidate alone, so how the batch is split and who
//! answers changes nothing about the result.

use std::ops::Range;
use std::time::Duration;

use curionav_planning::generation::Generated;
use curionav_runtime::convert;
use curionav_runtime::query::AskError;
use curionav_schemas::{GenerateReply, Scores};
use futures_util::StreamExt;
use futures_util::stream::FuturesUnordered;

use crate::budget::Budget;
use crate::peers::{Call, Peers};
use crate::pool::{Answer, Pool};
use crate::question::{EvaluateQuestion, EvaluateQuestions, GenerateQuestion};

/// What a generator has answered: the tree as it has grown it, and the candidates.
#[derive(Debug)]
pub struct Grown {
    /// Candidates and tree.
    pub generated: Generated,
    /// Whether the budget has cut its growth short, as
    /// [`Course::generate`](curionav_planning::planner::Course::generate) says it.
    pub cut: bool,
}

/// How long candidates have to be.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Shape {
    /// States of each.
    pub steps: usize,
    /// Seconds between two of them.
    pub dt: f64,
}

/// Asks generators until one gives candidates of the right shape for tree `index` of a cycle.
pub async fn generate<P: Peers>(
    pool: &Pool<P>,
    robot: &str,
    question: &GenerateQuestion<'_>,
    index: usize,
    shape: Shape,
    budget: Budget,
) -> Option<Grown> {
    // The trees go to the preferred replicas in turn, because these have prepared for the goal. With fewer replicas
    // than trees, several trees share one. Any other replica can take over, because the tree travels with the question.
    let role = question.role();
    let preferred = {
        let mut replicas = pool.replicas();
        // Replicas whose rest is over may be asked again.
        replicas.wake(pool.peers.now());
        replicas.preferred(role)
    };
    let first = preferred.get(index % preferred.len().max(1))?.clone();
    let ask = |instance: String, timeout: Duration| async move {
        let call = Call { instance: &instance, robot, timeout, clock: budget.clock };
        usable(pool.peers.generate(call, question).await?, &instance, question.id(), shape)
    };
    pool.first_answer(role, first, budget, ask).await
}

fn usable(
    reply: GenerateReply,
    instance: &str,
    cycle: (u64, u64),
    shape: Shape,
) -> Result<Answer<Grown>, AskError> {
    let busy = Duration::from_micros(reply.elapsed_us);
    if (reply.epoch, reply.seq) != cycle || reply.instance != instance {
        return Err(AskError::Malformed("candidates of another cycle or replica".into()));
    }
    let candidates = convert::candidates(reply.candidates).map_err(|r| AskError::Malformed(r.to_string()))?;
    if (Shape { steps: candidates.steps(), dt: candidates.dt() }) != shape {
        return Err(AskError::Malformed("candidates of another shape".into()));
    }
    let count = candidates.len();
    let generated = Generated { candidates, tree: convert::tree(reply.tree) };
    Ok(Answer { value: Grown { generated, cut: reply.cut }, count, busy })
}

/// A shard, which is a slice of the batch of candidates that one replica scores, with its scores under one term.
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

/// Asks replicas what the candidates of `questions` cost under each of `terms`; all shards of all terms at once.
/// `robot` is the name in whose turn replicas answer.
pub async fn evaluate<P: Peers>(
    pool: &Pool<P>,
    terms: &[String],
    robot: &str,
    questions: &EvaluateQuestions<'_>,
    budget: Budget,
) -> Vec<Shard> {
    let started = pool.peers.now();
    pool.replicas().wake(started);
    let open = FuturesUnordered::new();
    for term in terms {
        let assignments = pool.replicas().split(term, questions.count());
        for (number, assignment) in assignments.into_iter().enumerate() {
            let range = assignment.range;
            let question = questions.shard(term, number as u32, range.clone());
            open.push(async move {
                let cost = evaluate_shard(pool, term, robot, assignment.instance, &question, budget).await;
                Shard { term: term.clone(), range, cost, elapsed: pool.peers.now() - started }
            });
        }
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
        && scores.term == term
        && scores.instance == instance
        && scores.cost.len() == question.count()
}
