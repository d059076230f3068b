//! One planning cycle, from belief to decision. Algorithms and equations are those of the paper (`docs/methods.md`).

use std::time::Duration;

use curionav_pool::context::PlanContext;
use curionav_pool::peers::Peers;
use curionav_pool::pool::Pool;
use curionav_robot::arbiter::cycle::{
    Failure, Observation, Remembered, begin, choose, observe, remember, stand,
};
use curionav_robot::arbiter::decision_message;
use curionav_robot::arbiter::memory::Memory;
use curionav_runtime::convert;
use curionav_schemas::{self as wire, Timings};

use crate::evaluation_stage::{EvaluationOutcome, evaluate};
use crate::generation_stage::{GenerationOutcome, generate};
use crate::report::CycleOutcome;

/// Plans one cycle (Alg. 2), whose number is `memory.seq`. Besides the decision, the outcome has what led to it. The
/// decision also says what the cycle had to do without. Each of the two stages, generation and evaluation, has a
/// [`Budget`](curionav_pool::budget::Budget) of time.
pub async fn plan<P: Peers>(
    pool: &Pool<P>,
    context: &PlanContext,
    memory: &mut Memory,
    observation: Observation,
) -> (wire::Decision, CycleOutcome) {
    let started = pool.peers.now();
    let id = memory.id();

    // What stays the same on the way to one goal.
    let course = &context.course;

    // Observe (Alg. 2, lines 3 to 10).
    let scene = begin(course, memory, &observation);
    let scene_message = convert::scene_to_wire(&scene, observation.belief.health);

    // Generate: replicas grow the trees, which travel with the questions.
    let GenerationOutcome { candidates, shortfalls: mut degraded } =
        generate(pool, context, memory, &scene, &scene_message).await;
    let generated = pool.peers.now();

    // Evaluate: shards over every replica, and in process what no replica has scored.
    let EvaluationOutcome { scores, evaluated, times, shortfalls } =
        evaluate(pool, context, id, started, &scene, &scene_message, &candidates).await;
    degraded.extend(shortfalls);
    let scored = pool.peers.now();
    pool.stages().took(generated - started, scored - generated);

    // Decide (eqs. 4 to 6).
    let verdict = choose(course, memory, &scene, &candidates, &scores);
    let decided = pool.peers.now();
    let timings = Timings {
        generate_us: microseconds(generated - started),
        evaluate_us: times,
        arbitrate_us: microseconds(decided - scored),
        total_us: microseconds(decided - started),
    };
    let decision =
        decision_message::decision(id, &scene, &verdict.decision, evaluated, degraded, timings.total_us);

    // Remember for the next cycle, and for the report of this one.
    let Remembered { previous, gap, driven } = remember(memory, &context.mission, &scene, &verdict);
    let outcome =
        CycleOutcome { scene_message, scene, candidates, verdict, scores, previous, timings, gap, driven };
    (decision, outcome)
}

fn microseconds(time: Duration) -> u64 {
    time.as_micros() as u64
}

/// Makes the decision of one cycle. If the mission is running, `context` is prepared for it and `people` are recent, it
/// is what [`plan`] decides. Otherwise it is a stop without planning: then there is no outcome, and nothing to report.
pub async fn decide<P: Peers>(
    pool: &Pool<P>,
    context: Option<&PlanContext>,
    memory: &mut Memory,
    mission: &wire::Mission,
    belief: wire::Belief,
    people: Option<wire::People>,
) -> (wire::Decision, Option<CycleOutcome>) {
    memory.seq += 1;
    let newest_belief = belief.clone();
    let observed = prepared(context, mission)
        .and_then(|context| Ok((context, observe(&context.course, memory, mission, belief, people)?)));
    match observed {
        Ok((context, observation)) => {
            let (decision, outcome) = plan(pool, context, memory, observation).await;
            (decision, Some(outcome))
        }
        Err(failure) => (stand(memory, failure, &newest_belief, mission), None),
    }
}

/// The context of a running mission, if it is prepared for it.
fn prepared<'a>(
    context: Option<&'a PlanContext>,
    mission: &wire::Mission,
) -> Result<&'a PlanContext, Failure> {
    if mission.state != wire::MissionState::Running {
        return Err(Failure::not_running(mission.state));
    }
    let is_of = |it: &&PlanContext| (it.mission.run, it.mission.revision) == (mission.run, mission.revision);
    context.filter(is_of).ok_or_else(Failure::not_prepared)
}
