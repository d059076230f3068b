//! One planning cycle, from belief to decision: the function to read first is [`plan`].

use std::time::Duration;

use curionav_planning::arbitration::{Previous, arbitrate};
use curionav_runtime::convert;
use curionav_schemas::{self as wire, Degradation, Reason, Reject, Timings};

use crate::evaluation_stage::{EvaluationOutcome, evaluate};
use crate::generation_stage::{GenerationOutcome, grow};
use crate::memory::Memory;
use crate::report::{self, Account};
use curionav_pool::context::{self, PlanContext};
use curionav_pool::peers::Peers;
use curionav_pool::pool::Pool;

/// People this much older than the belief are no longer acted on, seconds of the robot's clock. Nor are those this much
/// newer: a belief may lag behind, but these were seen before the base started over.
const PEOPLE_AGE_MAX: f64 = 1.0;

/// What a cycle starts from.
#[derive(Debug, Clone)]
pub struct Observation {
    /// The localiser's answer.
    pub belief: wire::Belief,
    /// All people around, in their own frame.
    pub people: wire::People,
}

/// Plans once (Alg. 2). Always ends in a decision; what went wrong on the way is in it.
///
/// # Errors
/// The observation or an answer of the arbiter itself is not valid; the caller stops the robot.
pub async fn plan<P: Peers>(
    pool: &Pool<P>,
    context: &PlanContext,
    memory: &mut Memory,
    observation: Observation,
) -> Result<(wire::Decision, Account), Reject> {
    let peers = &*pool.peers;
    let started = peers.now();
    memory.seq += 1;
    let id = memory.id();

    // Observe: working zone and the two hystereses (Alg. 2, lines 3 to 10).
    let (tick, stamp) = (observation.belief.tick, observation.belief.stamp);
    let belief = convert::belief(&observation.belief)?;
    let people = convert::people(&observation.people, belief.pose);
    let scene = memory.observer.form_scene(&context.profile, &context.robot, tick, stamp, belief, &people);
    let scene_message = convert::scene_to_wire(&scene, observation.belief.health.clone());

    // Generate: any replica takes over the tree, which travels as a value.
    memory.trees.resize(context.profile.trees as usize, None);
    let ahead = memory.previous.as_ref().map(|previous| context::ahead(previous, stamp)).unwrap_or_default();
    let requests = (memory.trees.iter().enumerate())
        .map(|(i, tree)| context.generate_request(id, &scene_message, i, tree.as_ref(), &ahead))
        .collect::<Result<Vec<_>, _>>()?;
    let GenerationOutcome { candidates, shortfalls } =
        grow(pool, context, &scene, &requests, &ahead, &mut memory.trees).await;
    let mut degraded = shortfalls;
    let generated = peers.now();

    // Evaluate: shards over every replica; in process what no replica has scored.
    let EvaluationOutcome { scores, evaluated, times, shortfalls } =
        evaluate(pool, context, id, &scene, &scene_message, &candidates).await;
    degraded.extend(shortfalls);

    // Decide (eqs. 4 to 6).
    let arbitrating = peers.now();
    let arbitration = context.arbitration(&scene, &candidates, memory.previous.as_ref());
    let verdict = arbitrate(&arbitration, &scores);
    let us = |time: Duration| time.as_micros() as u64;
    let timings = Timings {
        generate_us: us(generated - started),
        evaluate_us: times,
        arbitrate_us: us(peers.now() - arbitrating),
        total_us: us(peers.now() - started),
    };
    let decision = report::decision(id, &scene, &verdict.decision, evaluated, degraded, timings.total_us);
    let next = Previous::of(&verdict.decision, stamp);
    let previous = std::mem::replace(&mut memory.previous, next);
    let gap = memory.gap(tick, u64::from(context.mission.order.plan_every));
    let driven = memory.driven.clone();
    let account =
        Account { scene_message, scene, candidates, verdict, scores, previous, timings, gap, driven };
    Ok((decision, account))
}

/// The decision for one planning tick: a stop unless the mission is running, `context` is prepared for it and
/// `people` are recent; else what [`plan`] makes of it, with its account.
pub async fn decide<P: Peers>(
    pool: &Pool<P>,
    context: Option<&PlanContext>,
    memory: &mut Memory,
    mission: &wire::Mission,
    belief: wire::Belief,
    people: Option<wire::People>,
) -> (wire::Decision, Option<Account>) {
    let seen_from = belief.clone();
    let stop = |memory: &mut Memory, reason, degraded| {
        memory.seq += 1;
        (report::stop(memory.id(), &seen_from, mission.order.tick_s, reason, degraded), None)
    };
    if mission.state != wire::MissionState::Running {
        return stop(memory, Reason::MissionNotRunning { state: mission.state }, None);
    }
    let of = |c: &&PlanContext| (c.mission.run, c.mission.revision) == (mission.run, mission.revision);
    let Some(context) = context.filter(of) else {
        return stop(memory, Reason::NotPrepared, Some(Degradation::NotPrepared));
    };
    let Some(people) = people.filter(|people| (belief.stamp - people.stamp).abs() <= PEOPLE_AGE_MAX) else {
        return stop(memory, Reason::PeopleUnknown, Some(Degradation::PeopleUnknown));
    };
    match plan(pool, context, memory, Observation { belief, people }).await {
        Ok((decision, account)) => (decision, Some(account)),
        Err(reject) => {
            tracing::error!(%reject, "the cycle failed");
            stop(memory, Reason::CycleFailed, Some(Degradation::CycleFailed))
        }
    }
}
