//! Work over replicas: shards, time limits, asking again elsewhere.
//!
//! A candidate's cost depends on the scene and on that candidate alone, so how the batch is cut and who
//! answers changes nothing about the result.

use std::ops::Range;
use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_planning::candidates::CandidateSet;
use curionav_runtime::convert;
use curionav_schemas::{EvaluateRequest, GenerateRequest, Scores, Tree};
use tokio::task::JoinSet;

use crate::peers::{GENERATOR, Peers};

/// Candidates below which a batch is not cut further: a query costs more than scoring them.
const SHARD_MIN: usize = 16;

/// One cycle's time for a stage.
#[derive(Debug, Clone, Copy)]
pub struct Budget {
    /// When the stage began.
    pub start: Instant,
    /// How long it may take.
    pub total: Duration,
}

impl Budget {
    /// A budget that begins now.
    pub fn new(total: Duration) -> Self {
        Self { start: Instant::now(), total }
    }

    /// What is left.
    pub fn remaining(&self) -> Duration {
        self.total.saturating_sub(self.start.elapsed())
    }

    /// Time for the next attempt when `others` replicas could be asked after it. All attempts together
    /// end by half of the whole: the other half is for computing in process.
    fn attempt(&self, others: usize) -> Option<Duration> {
        let left = (self.total / 2).saturating_sub(self.start.elapsed());
        let limit = if others > 0 { left / 2 } else { left };
        (limit > Duration::from_millis(1)).then_some(limit)
    }
}

/// What a replica may spend computing of the time it is waited for: the rest is for the way.
fn budget_ms(timeout: Duration) -> u32 {
    (timeout.as_millis() * 4 / 5).clamp(1, u128::from(u32::MAX)) as u32
}

/// Asks generators one after the other until one gives candidates of the right shape.
pub async fn generate<P: Peers>(
    peers: &P,
    mut request: GenerateRequest,
    shape: (usize, f64),
    budget: Budget,
) -> Option<(CandidateSet, Tree)> {
    let instances = peers.warm(GENERATOR);
    for (asked, instance) in rotated(&instances, request.seq).enumerate() {
        let timeout = budget.attempt(instances.len() - asked - 1)?;
        request.budget_ms = budget_ms(timeout);
        let reply = match peers.generate(instance, &request, timeout).await {
            Ok(reply) => reply,
            Err(error) => {
                tracing::warn!(instance, %error, "generator failed, asking another");
                continue;
            }
        };
        let of_this_cycle = (reply.epoch, reply.seq) == (request.epoch, request.seq);
        match convert::candidates(reply.candidates) {
            Ok(candidates) if of_this_cycle && (candidates.steps(), candidates.dt()) == shape => {
                return Some((candidates, reply.tree));
            }
            Ok(_) => {
                tracing::warn!(instance, "generated for another cycle or in another shape, asking another")
            }
            Err(reject) => tracing::warn!(instance, %reject, "generated nonsense, asking another"),
        }
    }
    None
}

/// Scores of one shard.
#[derive(Debug)]
pub struct Shard {
    /// Which metric.
    pub metric: String,
    /// Which candidates.
    pub range: Range<usize>,
    /// Their costs, or nothing if no replica answered in time.
    pub cost: Option<Vec<f64>>,
    /// Microseconds from asking to having it.
    pub elapsed: Duration,
}

/// Scores `count` candidates under each of `metrics`, all shards at once. `request` makes the question for
/// (metric, candidates).
pub async fn evaluate<P: Peers>(
    peers: &Arc<P>,
    metrics: &[String],
    count: usize,
    request: impl Fn(&str, Range<usize>) -> EvaluateRequest,
    budget: Budget,
) -> Vec<Shard> {
    let mut tasks = JoinSet::new();
    for metric in metrics {
        let instances = peers.warm(metric);
        for (index, range) in shards(count, instances.len()).into_iter().enumerate() {
            let mut question = request(metric, range.clone());
            question.shard = index as u32;
            let order: Vec<String> =
                rotated(&instances, question.seq + index as u64).map(ToOwned::to_owned).collect();
            let (peers, metric) = (Arc::clone(peers), metric.clone());
            tasks.spawn(async move {
                let cost = evaluate_shard(&*peers, &metric, &order, question, range.len(), budget).await;
                Shard { metric, range, cost, elapsed: budget.start.elapsed() }
            });
        }
    }
    let mut done = Vec::new();
    while let Some(joined) = tasks.join_next().await {
        match joined {
            Ok(shard) => done.push(shard),
            Err(error) => tracing::error!(%error, "a shard's task failed"),
        }
    }
    done.sort_by(|a, b| (&a.metric, a.range.start).cmp(&(&b.metric, b.range.start)));
    done
}

async fn evaluate_shard<P: Peers>(
    peers: &P,
    metric: &str,
    order: &[String],
    mut request: EvaluateRequest,
    count: usize,
    budget: Budget,
) -> Option<Vec<f64>> {
    for (asked, instance) in order.iter().enumerate() {
        let timeout = budget.attempt(order.len() - asked - 1)?;
        request.budget_ms = budget_ms(timeout);
        match peers.evaluate(metric, instance, &request, timeout).await {
            Ok(scores) if fits(&scores, &request, metric, count) => return Some(scores.cost.0),
            Ok(_) => tracing::warn!(metric, instance, "scores are not for this shard"),
            Err(error) => tracing::warn!(metric, instance, %error, "evaluator failed, asking another"),
        }
    }
    None
}

fn fits(scores: &Scores, request: &EvaluateRequest, metric: &str, count: usize) -> bool {
    (scores.epoch, scores.seq, scores.shard) == (request.epoch, request.seq, request.shard)
        && scores.metric == metric
        && scores.cost.len() == count
}

/// Contiguous ranges of nearly equal size, at most one a replica, none smaller than [`SHARD_MIN`] unless it
/// is the only one. No replicas, no shards.
fn shards(count: usize, replicas: usize) -> Vec<Range<usize>> {
    if count == 0 || replicas == 0 {
        return Vec::new();
    }
    let n = replicas.min((count / SHARD_MIN).max(1));
    (0..n).map(|i| i * count / n..(i + 1) * count / n).collect()
}

/// All instances, starting at a different one each time, so that load spreads.
fn rotated(instances: &[String], by: u64) -> impl Iterator<Item = &str> {
    let n = instances.len();
    let first = if n == 0 { 0 } else { (by % n as u64) as usize };
    (0..n).map(move |i| instances[(first + i) % n].as_str())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_cover_every_candidate_once() {
        for count in [0, 1, 15, 16, 31, 32, 100, 2000] {
            for replicas in 0..9 {
                let all: Vec<usize> = shards(count, replicas).into_iter().flatten().collect();
                let expected: Vec<usize> = if replicas == 0 { Vec::new() } else { (0..count).collect() };
                assert_eq!(all, expected, "{count} over {replicas}");
            }
        }
        assert_eq!(shards(100, 3), vec![0..33, 33..66, 66..100]);
        assert_eq!(shards(20, 3).len(), 1);
    }

    #[test]
    fn rotation_visits_everybody() {
        let names: Vec<String> = ["a", "b", "c"].map(String::from).to_vec();
        assert_eq!(rotated(&names, 4).collect::<Vec<_>>(), ["b", "c", "a"]);
        assert_eq!(rotated(&[], 4).count(), 0);
    }
}
