//! One planning cycle, from belief to decision: the function to read first.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_planning::arbitration::{self, Observer, Previous, Scores, arbitrate};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::scene::Scene;
use curionav_runtime::evaluators::AT_HOME;
use curionav_runtime::{convert, generator};
use curionav_schemas::{self as wire, Clock, Evaluated, MetricTime, Reject, Timings};

use crate::context::PlanContext;
use crate::dispatch::{self, Budget, Shard};
use crate::peers::Peers;
use crate::report;

/// What the arbiter remembers from one cycle to the next.
#[derive(Debug, Default)]
pub struct Memory {
    /// Rises with every restart.
    pub epoch: u64,
    /// Rises with every cycle.
    pub seq: u64,
    observer: Observer,
    tree: Option<wire::Tree>,
    previous: Option<Previous>,
}

impl Memory {
    /// The memory at the start of a mission: sequence numbers go on, nothing else does.
    pub fn fresh(&self) -> Self {
        Self { epoch: self.epoch, seq: self.seq, ..Self::default() }
    }
}

/// What a cycle starts from.
#[derive(Debug, Clone)]
pub struct Observation {
    /// The localiser's answer.
    pub belief: wire::Belief,
    /// Everybody around, in their own frame.
    pub people: wire::People,
}

/// How long each stage of a cycle may take.
#[derive(Debug, Clone, Copy)]
pub struct CycleBudget {
    /// Asking generators.
    pub generate: Duration,
    /// Asking evaluators.
    pub evaluate: Duration,
}

impl CycleBudget {
    /// In lockstep a slow machine must never change a decision, so the budget only catches what hangs. In
    /// real time the whole cycle has four fifths of its period.
    pub fn of(mission: &wire::Mission) -> Self {
        match mission.clock {
            Clock::Lockstep => Self { generate: Duration::from_secs(10), evaluate: Duration::from_secs(10) },
            Clock::Realtime => {
                let period = mission.tick_s * f64::from(mission.plan_every) / mission.time_scale;
                let stage = Duration::from_secs_f64(0.4 * period);
                Self { generate: stage, evaluate: stage }
            }
        }
    }
}

/// Plans once. Always ends in a decision; what went wrong on the way is in it.
pub async fn plan<P: Peers>(
    peers: &Arc<P>,
    context: &PlanContext,
    memory: &mut Memory,
    observation: Observation,
) -> Result<(wire::Decision, wire::CycleReport), Reject> {
    let started = Instant::now();
    memory.seq += 1;
    let id = (memory.epoch, memory.seq);
    let budget = CycleBudget::of(&context.mission);
    let mut degraded = Vec::new();

    // Observe: working zone and the two hystereses (Alg. 2, lines 3 to 10).
    let (tick, stamp) = (observation.belief.tick, observation.belief.stamp);
    let belief = convert::belief(&observation.belief)?;
    let people = convert::people(&observation.people, belief.pose);
    let scene = memory.observer.form_scene(&context.profile, &context.robot, tick, stamp, belief, &people);
    let scene_message = convert::scene_to_wire(&scene, observation.belief.health.clone());

    // Generate: any replica takes over the tree, which travels as a value.
    let request =
        context.generate_request(id, &scene_message, memory.tree.take(), memory.previous.as_ref())?;
    let generating = Instant::now();
    let shape = (context.profile.steps, context.profile.dt);
    let asked = dispatch::generate(&**peers, request.clone(), shape, Budget::new(budget.generate)).await;
    let (candidates, tree) = match asked {
        Some(generated) => generated,
        None => {
            degraded.push("generated: local".to_owned());
            let reply = tokio::task::block_in_place(|| {
                generator::generate("arbiter", &request, &context.map, &context.geodesic, &|| false)
            })?;
            (convert::candidates(reply.candidates)?, reply.tree)
        }
    };
    let generate_us = generating.elapsed().as_micros() as u64;
    memory.tree = Some(tree);

    // Evaluate: shards over every replica; what nobody scored, in process.
    let (scores, evaluated, evaluate_us) =
        evaluate(peers, context, id, &scene, &scene_message, &candidates, budget.evaluate).await;
    degraded.extend(evaluated.iter().filter(|(_, how)| **how != Evaluated::Pool).filter_map(
        |(metric, how)| match how {
            Evaluated::Local if !AT_HOME.contains(&metric.as_str()) => {
                Some(format!("evaluated: local ({metric})"))
            }
            Evaluated::None => Some(format!("not evaluated ({metric})")),
            _ => None,
        },
    ));

    // Decide (eqs. 4 to 6).
    let arbitrating = Instant::now();
    let decision_context = arbitration::Context {
        profile: &context.profile,
        scene: &scene,
        map: &context.map,
        robot: &context.robot,
        goal: context.goal,
    };
    let verdict = arbitrate(&decision_context, &candidates, &scores, memory.previous.as_ref());
    memory.previous = Previous::of(&verdict.decision, stamp);
    let timings = Timings {
        generate_us,
        evaluate_us,
        arbitrate_us: arbitrating.elapsed().as_micros() as u64,
        total_us: started.elapsed().as_micros() as u64,
    };
    let decision = report::decision(id, &scene, &verdict.decision, evaluated, degraded, timings.total_us);
    let report = report::cycle(
        context,
        scene_message,
        &scene,
        &candidates,
        &verdict,
        &scores,
        decision.clone(),
        timings,
    );
    Ok((decision, report))
}

type Evaluation = (Scores, BTreeMap<String, Evaluated>, Vec<MetricTime>);

async fn evaluate<P: Peers>(
    peers: &Arc<P>,
    context: &PlanContext,
    id: (u64, u64),
    scene: &Scene,
    scene_message: &wire::Scene,
    candidates: &CandidateSet,
    budget: Duration,
) -> Evaluation {
    let active: Vec<String> =
        context.profile.active_terms(scene.uncertain).map(|(m, _)| m.to_owned()).collect();
    let remote: Vec<String> = active.iter().filter(|m| !AT_HOME.contains(&m.as_str())).cloned().collect();
    let budget = Budget::new(budget);
    let request =
        |metric: &str, range| context.evaluate_request(metric, id, scene_message, candidates, range);
    let shards = dispatch::evaluate(peers, &remote, candidates.len(), request, budget).await;
    tokio::task::block_in_place(|| gather(context, scene, candidates, &active, shards, budget))
}

/// Puts the shards together and computes in process what is missing, and what is at home here always.
fn gather(
    context: &PlanContext,
    scene: &Scene,
    candidates: &CandidateSet,
    active: &[String],
    shards: Vec<Shard>,
    budget: Budget,
) -> Evaluation {
    let mut scores = Scores::new(candidates.len());
    let mut times: BTreeMap<&str, u64> = BTreeMap::new();
    for shard in &shards {
        let Some(cost) = &shard.cost else { continue };
        if let Err(error) = scores.insert(&shard.metric, shard.range.start, cost) {
            tracing::warn!(%error, "shard not used");
        }
        let time = times.entry(&shard.metric).or_default();
        *time = (*time).max(shard.elapsed.as_micros() as u64);
    }
    let mut evaluated = BTreeMap::new();
    for metric in active {
        let missing = scores.missing(metric);
        let started = Instant::now();
        let how = if missing.is_empty() {
            Evaluated::Pool
        } else {
            score_locally(context, scene, candidates, metric, &missing, &mut scores, budget)
        };
        if how == Evaluated::Local {
            *times.entry(metric).or_default() += started.elapsed().as_micros() as u64;
        }
        evaluated.insert(metric.clone(), how);
    }
    let times = times.into_iter().map(|(metric, us)| MetricTime { metric: metric.to_owned(), us }).collect();
    (scores, evaluated, times)
}

/// Candidates scored in one go in process: what is done when time runs out is kept.
const LOCAL_CHUNK: usize = 16;

/// Scores the `missing` candidates in process, in order, for as long as the budget lasts.
fn score_locally(
    context: &PlanContext,
    scene: &Scene,
    candidates: &CandidateSet,
    metric: &str,
    missing: &[usize],
    scores: &mut Scores,
    budget: Budget,
) -> Evaluated {
    let Some(evaluator) = context.local(metric) else { return Evaluated::None };
    // Scoring in process must not be cut short where it is all there is.
    let is_over = || !AT_HOME.contains(&metric) && budget.remaining().is_zero();
    for run in missing.chunks(LOCAL_CHUNK).flat_map(runs) {
        match evaluator.evaluate(scene, &candidates.slice(run.clone()), &is_over) {
            Ok(cost) => {
                if let Err(error) = scores.insert(metric, run.start, &cost) {
                    tracing::error!(%error, "own scores not used");
                }
            }
            Err(stopped) => {
                tracing::warn!(metric, %stopped, "in-process evaluation ran out of time");
                break;
            }
        }
    }
    if scores.missing(metric).len() < missing.len() { Evaluated::Local } else { Evaluated::None }
}

/// Ascending indices as contiguous runs.
fn runs(indices: &[usize]) -> Vec<std::ops::Range<usize>> {
    let mut runs: Vec<std::ops::Range<usize>> = Vec::new();
    for &i in indices {
        match runs.last_mut() {
            Some(run) if run.end == i => run.end += 1,
            _ => runs.push(i..i + 1),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_are_contiguous_and_complete() {
        assert_eq!(runs(&[]), Vec::<std::ops::Range<usize>>::new());
        assert_eq!(runs(&[0, 1, 2, 5, 7, 8]), vec![0..3, 5..6, 7..9]);
    }
}
