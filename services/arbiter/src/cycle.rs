//! One planning cycle, from belief to decision: the function to read first.

use std::collections::BTreeMap;
use std::time::Duration;

use curionav_planning::arbitration::{self, Observer, Previous, Scores, Trajectory, arbitrate, explain};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::scene::Scene;
use curionav_runtime::convert;
use curionav_runtime::evaluators::AT_HOME;
use curionav_schemas::{self as wire, Evaluated, MetricTime, Reject, Timings};

use crate::budget::Budget;
use crate::context::PlanContext;
use crate::dispatch::{self, Shard};
use crate::growth::{self, Grown};
use crate::in_process;
use crate::peers::Peers;
use crate::pool::Pool;
use crate::report;
use crate::succession::{Order, Succession};

/// What the arbiter remembers from one cycle to the next.
#[derive(Debug, Default)]
pub struct Memory {
    succession: Succession,
    /// Rises with every cycle.
    pub seq: u64,
    /// Tick of the last report.
    pub reported: Option<u64>,
    observer: Observer,
    trees: Vec<Option<wire::Tree>>,
    previous: Option<Previous>,
}

impl Memory {
    /// The memory of an arbiter that has just started. `nonce` should differ from that of any other arbiter.
    pub fn new(nonce: u64) -> Self {
        Self { succession: Succession::new(nonce), ..Self::default() }
    }

    /// The memory that was carried into a recorded cycle: what is planned next is that cycle. Trees are only what
    /// they were if the generator is.
    pub fn recall(memory: wire::Memory) -> Result<Self, Reject> {
        let previous =
            memory.previous.map(|p| {
                Trajectory::new(p.dt, p.x.0, p.y.0, p.heading.0, p.v.0, p.omega.0).map(|trajectory| {
                    Previous { trajectory, candidate: p.candidate, stamp: p.stamp, valid_for: p.valid_for_s }
                })
            });
        let previous = previous.transpose().map_err(|e| Reject::invalid("previous", e.to_string()))?;
        Ok(Self {
            succession: Succession::resume(memory.epoch),
            seq: memory.seq.saturating_sub(1),
            reported: None,
            observer: Observer::resume(memory.uncertain, memory.members.0),
            trees: memory.trees.into_iter().map(|tree| Some(tree).filter(|t| !t.x.is_empty())).collect(),
            previous,
        })
    }

    /// What is carried into the next cycle of `mission`, for whoever records it.
    pub fn to_wire(&self, mission: &wire::Mission) -> wire::Memory {
        let previous = self.previous.as_ref().map(|p| wire::Previous {
            candidate: p.candidate,
            stamp: p.stamp,
            valid_for_s: p.valid_for,
            dt: p.trajectory.dt(),
            x: p.trajectory.x().into(),
            y: p.trajectory.y().into(),
            heading: p.trajectory.heading().into(),
            v: p.trajectory.v().into(),
            omega: p.trajectory.omega().into(),
        });
        wire::Memory {
            robot: mission.robot.clone(),
            epoch: self.succession.epoch(),
            seq: self.seq + 1,
            run: mission.run,
            revision: mission.revision,
            version: env!("CARGO_PKG_VERSION").to_owned(),
            uncertain: self.observer.is_uncertain(),
            members: self.observer.members().into(),
            previous,
            trees: self.trees.iter().map(|tree| tree.clone().unwrap_or_default()).collect(),
        }
    }

    /// The memory at the start of a mission: sequence numbers go on, nothing else does.
    pub fn fresh(&self) -> Self {
        Self { succession: self.succession.fresh(), seq: self.seq, ..Self::default() }
    }

    /// Outranks whoever made the last decision the driver has obeyed, if any.
    pub fn succeed(&mut self, obeyed: Option<Order>) {
        self.succession.succeed(obeyed, self.seq);
    }

    /// Takes note of a command of the driver: of which decision, and when.
    pub fn hear(&mut self, command: &wire::Twist) {
        self.succession.hear((command.epoch, command.seq), command.stamp, self.seq);
    }

    /// (epoch, seq) of the newest decision.
    pub fn id(&self) -> Order {
        (self.succession.epoch(), self.seq)
    }

    /// Planning ticks of `period` ticks each between the last report and that of `tick`.
    fn gap(&mut self, tick: u64, period: u64) -> u64 {
        let last = self.reported.replace(tick);
        last.map_or(0, |last| (tick.saturating_sub(last) / period.max(1)).saturating_sub(1))
    }
}

/// People this much older than the belief are no longer acted on, seconds of the robot's clock. Nor are those this much
/// newer: a belief may lag behind, but these were seen before the base started over.
const PEOPLE_AGE_MAX: f64 = 1.0;

/// What a cycle starts from.
#[derive(Debug, Clone)]
pub struct Observation {
    /// The localiser's answer.
    pub belief: wire::Belief,
    /// Everybody around, in their own frame.
    pub people: wire::People,
}

/// The decision for one planning tick: a stop unless the mission is running, `context` is prepared for it and
/// `people` are recent; else what [`plan`] makes of it, with its report.
pub async fn decide<P: Peers>(
    pool: &Pool<P>,
    context: Option<&PlanContext>,
    memory: &mut Memory,
    mission: &wire::Mission,
    belief: wire::Belief,
    people: Option<wire::People>,
) -> (wire::Decision, Option<wire::CycleReport>) {
    let seen_from = belief.clone();
    let stop = |memory: &mut Memory, reason: &str, degraded| {
        memory.seq += 1;
        (report::stop(memory.id(), &seen_from, mission.tick_s, reason, degraded), None)
    };
    if mission.state != wire::MissionState::Running {
        return stop(memory, &format!("the mission is {}", mission.state), false);
    }
    let of = |c: &&PlanContext| (c.mission.run, c.mission.revision) == (mission.run, mission.revision);
    let Some(context) = context.filter(of) else {
        return stop(memory, "the mission is not prepared", true);
    };
    let Some(people) = people.filter(|people| (belief.stamp - people.stamp).abs() <= PEOPLE_AGE_MAX) else {
        return stop(memory, "nobody says where people are", true);
    };
    match plan(pool, context, memory, Observation { belief, people }).await {
        Ok((decision, report)) => (decision, Some(report)),
        Err(reject) => {
            tracing::error!(%reject, "the cycle failed");
            stop(memory, "the cycle failed", true)
        }
    }
}

/// Plans once. Always ends in a decision; what went wrong on the way is in it.
pub async fn plan<P: Peers>(
    pool: &Pool<P>,
    context: &PlanContext,
    memory: &mut Memory,
    observation: Observation,
) -> Result<(wire::Decision, wire::CycleReport), Reject> {
    let peers = &*pool.peers;
    let started = peers.now();
    memory.seq += 1;
    let id = memory.id();
    let mut degraded = Vec::new();

    // Observe: working zone and the two hystereses (Alg. 2, lines 3 to 10).
    let (tick, stamp) = (observation.belief.tick, observation.belief.stamp);
    let belief = convert::belief(&observation.belief)?;
    let people = convert::people(&observation.people, belief.pose);
    let scene = memory.observer.form_scene(&context.profile, &context.robot, tick, stamp, belief, &people);
    let scene_message = convert::scene_to_wire(&scene, observation.belief.health.clone());

    // Generate: any replica takes over the tree, which travels as a value.
    memory.trees.resize(context.profile.trees as usize, None);
    let requests = (memory.trees.drain(..).enumerate())
        .map(|(i, tree)| context.generate_request(id, &scene_message, i, tree, memory.previous.as_ref()))
        .collect::<Result<Vec<_>, _>>()?;
    let Grown { candidates, trees, shortfalls } = growth::grow(pool, context, &requests).await?;
    memory.trees = trees;
    degraded.extend(shortfalls.into_iter().map(str::to_owned));
    let generated = peers.now();

    // Evaluate: shards over every replica; what nobody scored, in process.
    let (scores, evaluated, evaluate_us) =
        evaluate(pool, context, id, &scene, &scene_message, &candidates).await;
    degraded.extend(evaluated.iter().filter_map(|(metric, how)| match how {
        Evaluated::Local if !AT_HOME.contains(&metric.as_str()) => {
            Some(format!("evaluated: local ({metric})"))
        }
        Evaluated::None => Some(format!("not evaluated ({metric})")),
        Evaluated::Pool if !scores.missing(metric).is_empty() => Some(format!("partly evaluated ({metric})")),
        _ => None,
    }));

    // Decide (eqs. 4 to 6).
    let arbitrating = peers.now();
    let decision_context = arbitration::Context {
        profile: &context.profile,
        scene: &scene,
        map: &context.map,
        robot: &context.robot,
        goal: context.goal,
    };
    let verdict = arbitrate(&decision_context, &candidates, &scores, memory.previous.as_ref());
    let explanation = explain(&decision_context, &candidates, &verdict, memory.previous.as_ref());
    memory.previous = Previous::of(&verdict.decision, stamp);
    let us = |time: Duration| time.as_micros() as u64;
    let timings = Timings {
        generate_us: us(generated - started),
        evaluate_us,
        arbitrate_us: us(peers.now() - arbitrating),
        total_us: us(peers.now() - started),
    };
    let gap = memory.gap(tick, u64::from(context.mission.plan_every));
    let decision = report::decision(id, &scene, &verdict.decision, evaluated, degraded, timings.total_us);
    let report = report::cycle(
        context,
        scene_message,
        &scene,
        &candidates,
        &verdict,
        &explanation,
        &scores,
        decision.clone(),
        timings,
        gap,
    );
    Ok((decision, report))
}

type Evaluation = (Scores, BTreeMap<String, Evaluated>, Vec<MetricTime>);

async fn evaluate<P: Peers>(
    pool: &Pool<P>,
    context: &PlanContext,
    id: (u64, u64),
    scene: &Scene,
    scene_message: &wire::Scene,
    candidates: &CandidateSet,
) -> Evaluation {
    let active: Vec<String> =
        context.profile.active_terms(scene.uncertain).map(|(m, _)| m.to_owned()).collect();
    let remote: Vec<String> = active.iter().filter(|m| !AT_HOME.contains(&m.as_str())).cloned().collect();
    let started = pool.peers.now();
    let stage = Budget::of_stage(started, &context.mission);
    let request =
        |metric: &str, range| context.evaluate_request(metric, id, scene_message, candidates, range);
    let robot = &context.mission.robot;
    let shards = dispatch::evaluate(pool, &remote, robot, candidates.len(), request, stage).await;
    let (mut scores, mut times) = gather(candidates.len(), &shards);

    let missing: Vec<&str> =
        active.iter().map(String::as_str).filter(|m| !scores.missing(m).is_empty()).collect();
    let is_over = || stage.is_over(pool.peers.now());
    let local =
        pool.peers.compute(|| in_process::score(context, scene, candidates, &missing, &mut scores, &is_over));
    let all = (pool.peers.now() - started).as_micros() as u64;
    let evaluated: BTreeMap<String, Evaluated> = active
        .iter()
        .map(|metric| {
            let how = if local.contains(metric.as_str()) {
                Evaluated::Local
            } else if missing.contains(&metric.as_str()) && scores.missing(metric).len() == candidates.len() {
                Evaluated::None
            } else {
                Evaluated::Pool
            };
            (metric.clone(), how)
        })
        .collect();
    times.extend(local.iter().map(|metric| ((*metric).to_owned(), all)));
    let times = times.into_iter().map(|(metric, us)| MetricTime { metric, us }).collect();
    (scores, evaluated, times)
}

/// Puts the shards together.
fn gather(count: usize, shards: &[Shard]) -> (Scores, BTreeMap<String, u64>) {
    let mut scores = Scores::new(count);
    let mut times: BTreeMap<String, u64> = BTreeMap::new();
    for shard in shards {
        let Some(cost) = &shard.cost else { continue };
        match scores.insert(&shard.metric, shard.range.start, cost) {
            Ok(0) => {}
            Ok(refused) => tracing::warn!(metric = shard.metric, refused, "costs that are none"),
            Err(error) => tracing::warn!(%error, "shard not used"),
        }
        let time = times.entry(shard.metric.clone()).or_default();
        *time = (*time).max(shard.elapsed.as_micros() as u64);
    }
    (scores, times)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_gap_is_what_has_no_report() {
        let mut memory = Memory::new(0);
        let gaps: Vec<u64> = [0, 3, 6, 15, 18].into_iter().map(|tick| memory.gap(tick, 3)).collect();
        assert_eq!(gaps, [0, 0, 0, 2, 0]);
    }
}
