//! One planning cycle, from belief to decision. Algorithms and equations are those of the paper (`docs/methods.md`).

use std::time::Duration;

use curionav_planning::arbitration::{self, arbitrate};
use curionav_planning::geometry::Point2;
use curionav_planning::scene::Moment;
use curionav_pool::context::PlanContext;
use curionav_pool::peers::Peers;
use curionav_pool::pool::Pool;
use curionav_runtime::convert;
use curionav_schemas::{self as wire, Degradation, Reason, Timings};

use crate::evaluation_stage::{EvaluationOutcome, evaluate};
use crate::generation_stage::{GenerationOutcome, generate};
use crate::memory::Memory;
use crate::report::{self, CycleOutcome};

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

    // Observe: who is near, and does the position count as uncertain? (Alg. 2, lines 3 to 10)
    let moment = Moment { tick: observation.belief.tick, stamp: observation.belief.stamp };
    let belief = convert::belief(&observation.belief);
    let people = convert::people_at(&observation.people, &belief, moment.stamp);
    let braked_for = memory.braked_for(moment.stamp);
    let observer = &mut memory.carried.observer;
    if let Some(seconds) = braked_for {
        course.observe_braking(observer, belief.pose, moment.stamp, seconds);
    }
    let mut scene = observer.form_scene(&course.profile, &course.robot, moment, belief, &people);
    course.complete(&mut scene);
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

    // Decide: the least total that is free of collisions (eqs. 4 to 6).
    let arbitration = course.arbitration(&scene, &candidates, memory.carried.previous.as_ref());
    let verdict = arbitrate(&arbitration, &scores);
    memory.observe_goal(verdict.decision.reason == arbitration::Reason::WaitsForGoal, moment.stamp);
    let decided = pool.peers.now();
    let timings = Timings {
        generate_us: microseconds(generated - started),
        evaluate_us: times,
        arbitrate_us: microseconds(decided - scored),
        total_us: microseconds(decided - started),
    };
    let decision = report::decision(id, &scene, &verdict.decision, evaluated, degraded, timings.total_us);

    // Remember for the next cycle, and for the report of this one: `gap` counts the planning ticks left out since the
    // last cycle, and `driven` is the driver's newest command.
    let previous = memory.carried.remember(&verdict.decision, moment.stamp);
    let gap = memory.gap(moment.tick, u64::from(context.mission.order.plan_every));
    let driven = memory.driven.clone();
    let outcome =
        CycleOutcome { scene_message, scene, candidates, verdict, scores, previous, timings, gap, driven };
    (decision, outcome)
}

fn microseconds(time: Duration) -> u64 {
    time.as_micros() as u64
}

/// What a cycle starts from.
#[derive(Debug, Clone)]
pub struct Observation {
    /// The localiser's answer.
    pub belief: wire::Belief,
    /// All people around, in the frame that the message names: the map's or that of the robot at the message's stamp.
    /// They are taken to have gone on at constant velocity since (A20).
    pub people: wire::People,
}

/// Greatest difference between the stamps of people and of the belief, seconds of the robot's clock. Beyond it people
/// count as unknown: they have moved on since, or the robot's clock has started over since they were seen.
const PEOPLE_AGE_MAX: f64 = 1.0;

/// A mission is given up after every way has been closed for so long, seconds: with the time in which a closed way is
/// seen, half a minute.
const CLOSED_MAX: f64 = 25.0;

/// So long a robot waits for a goal at which people stand, seconds.
const OCCUPIED_MAX: f64 = 30.0;

/// A mission is given up after the robot has not known for so long where it is, seconds.
const LOST_MAX: f64 = 30.0;

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
    match observe(context, memory, mission, belief, people) {
        Ok((context, observation)) => {
            let (decision, outcome) = plan(pool, context, memory, observation).await;
            (decision, Some(outcome))
        }
        Err(Failure { reason, degraded }) => {
            memory.carried.observer.forget_progress();
            if !matches!(reason, Reason::NoWayToGoal | Reason::GoalOccupied) {
                memory.forget_closed();
            }
            (report::stop(memory.id(), &newest_belief, mission.order.tick_s, reason, degraded), None)
        }
    }
}

/// Why nothing is planned.
struct Failure {
    reason: Reason,
    degraded: Option<Degradation>,
}

/// What a cycle of a running mission starts from, if everything is there.
fn observe<'a>(
    context: Option<&'a PlanContext>,
    memory: &mut Memory,
    mission: &wire::Mission,
    belief: wire::Belief,
    people: Option<wire::People>,
) -> Result<(&'a PlanContext, Observation), Failure> {
    if mission.state != wire::MissionState::Running {
        return Err(Failure { reason: Reason::MissionNotRunning { state: mission.state }, degraded: None });
    }
    let Some(context) =
        context.filter(|it| (it.mission.run, it.mission.revision) == (mission.run, mission.revision))
    else {
        return Err(Failure { reason: Reason::NotPrepared, degraded: Some(Degradation::NotPrepared) });
    };
    let is_lost = belief.health.confidence == wire::Confidence::Lost;
    if memory.observe_place(is_lost, belief.stamp) >= LOST_MAX {
        return Err(Failure { reason: Reason::PlaceUnknown, degraded: None });
    }
    if is_lost {
        return Err(Failure { reason: Reason::Localises, degraded: None });
    }
    let Some(people) = people.filter(|it| (belief.stamp - it.stamp).abs() <= PEOPLE_AGE_MAX) else {
        return Err(Failure { reason: Reason::PeopleUnknown, degraded: Some(Degradation::PeopleUnknown) });
    };
    let here = Point2::new(belief.x, belief.y);
    let are_closed = context.course.geodesic.is_closed(here, mission.order.goal_tolerance);
    if memory.observe_ways(are_closed, belief.stamp) >= CLOSED_MAX {
        return Err(Failure { reason: Reason::NoWayToGoal, degraded: None });
    }
    if memory.has_waited_for_goal(belief.stamp) >= OCCUPIED_MAX {
        return Err(Failure { reason: Reason::GoalOccupied, degraded: None });
    }
    Ok((context, Observation { belief, people }))
}
