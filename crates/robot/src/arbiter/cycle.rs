//! How a planning cycle begins and ends, and a whole one that is computed in one place.
//!
//! A cycle begins with [`observe`] and [`begin`] and ends with [`choose`] and [`remember`], whatever makes the
//! candidates in between and computes what they cost. The arbiter asks replicas; [`plan`] asks nothing.

use std::collections::BTreeMap;
use std::time::Duration;

use curionav_mission::convert;
use curionav_planning::arbitration::{self, Localising, Previous, Scores, Verdict, arbitrate};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::geometry::Point2;
use curionav_planning::planner::Course;
use curionav_planning::scene::{Belief, Moment, Scene};
use curionav_schemas::{self as wire, Decision, Degradation, Evaluated, Mission, Reason};

use super::decision_message as message;
use super::memory::Memory;
use super::obstacle_watch::ObstacleWatch;
use super::own_planner::OwnPlanner;

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

/// What a cycle starts from.
#[derive(Debug, Clone)]
pub struct Observation {
    /// The localiser's answer.
    pub belief: wire::Belief,
    /// All people around, in the frame that the message names: the map's or that of the robot at the message's stamp.
    /// They are taken to have gone on at constant velocity since (A20).
    pub people: wire::People,
}

/// Why nothing is planned.
#[derive(Debug, Clone, PartialEq)]
pub struct Failure {
    reason: Reason,
    degraded: Option<Degradation>,
}

impl Failure {
    /// The mission is in this state, not running.
    pub fn not_running(state: wire::MissionState) -> Self {
        Self { reason: Reason::MissionNotRunning { state }, degraded: None }
    }

    /// The course of the mission is not known yet.
    pub fn not_prepared() -> Self {
        Self { reason: Reason::NotPrepared, degraded: Some(Degradation::NotPrepared) }
    }

    fn given_up(reason: Reason) -> Self {
        Self { reason, degraded: None }
    }
}

/// What a cycle of a running mission starts from, if everything is there.
///
/// # Errors
/// The robot does not know its place, people are unknown, or the mission is to be given up.
pub fn observe(
    course: &Course,
    memory: &mut Memory,
    mission: &Mission,
    belief: wire::Belief,
    people: Option<wire::People>,
) -> Result<Observation, Failure> {
    let is_lost = belief.health.confidence == wire::Confidence::Lost;
    if memory.observe_place(is_lost, belief.stamp) >= LOST_MAX {
        return Err(Failure::given_up(Reason::PlaceUnknown));
    }
    if is_lost {
        return Err(Failure::given_up(Reason::Localises));
    }
    let Some(people) = people.filter(|it| (belief.stamp - it.stamp).abs() <= PEOPLE_AGE_MAX) else {
        return Err(Failure { reason: Reason::PeopleUnknown, degraded: Some(Degradation::PeopleUnknown) });
    };
    let here = Point2::new(belief.x, belief.y);
    let are_closed = course.geodesic.is_closed(here, mission.order.goal_tolerance);
    if memory.observe_ways(are_closed, belief.stamp) >= CLOSED_MAX {
        return Err(Failure::given_up(Reason::NoWayToGoal));
    }
    if memory.has_waited_for_goal(belief.stamp) >= OCCUPIED_MAX {
        return Err(Failure::given_up(Reason::GoalOccupied));
    }
    Ok(Observation { belief, people })
}

/// The stop of a cycle that does not plan, whose number is `memory.seq`.
pub fn stand(memory: &mut Memory, failure: Failure, belief: &wire::Belief, mission: &Mission) -> Decision {
    let Failure { reason, degraded } = failure;
    memory.carried.observer.forget_progress();
    if !matches!(reason, Reason::NoWayToGoal | Reason::GoalOccupied) {
        memory.forget_closed();
    }
    message::stop(memory.id(), belief, mission.order.tick_s, reason, degraded)
}

/// Observes: who is near, and does the position count as uncertain? (Alg. 2, lines 3 to 10)
pub fn begin(course: &Course, memory: &mut Memory, observation: &Observation) -> Scene {
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
    scene
}

/// Decides: the least total that is free of collisions (eqs. 4 to 6).
pub fn choose(
    course: &Course,
    memory: &mut Memory,
    scene: &Scene,
    candidates: &CandidateSet,
    scores: &Scores,
) -> Verdict {
    let arbitration = course.arbitration(scene, candidates, memory.carried.previous.as_ref());
    let verdict = arbitrate(&arbitration, scores);
    memory.observe_goal(verdict.decision.reason == arbitration::Reason::WaitsForGoal, scene.stamp);
    verdict
}

/// What a report says of the cycles before.
#[derive(Debug, Clone)]
pub struct Remembered {
    /// The decision before this one, as far as this cycle needed it.
    pub previous: Option<Previous>,
    /// Planning ticks left out since the last cycle.
    pub gap: u64,
    /// The driver's newest command.
    pub driven: Option<wire::Twist>,
}

/// Makes the verdict on `scene` the newest; gives what was the newest before.
pub fn remember(memory: &mut Memory, mission: &Mission, scene: &Scene, verdict: &Verdict) -> Remembered {
    Remembered {
        previous: memory.carried.remember(&verdict.decision, scene.stamp),
        gap: memory.gap(scene.tick, u64::from(mission.order.plan_every)),
        driven: memory.driven.clone(),
    }
}

/// What a decision was made from.
#[derive(Debug, Clone)]
pub struct Planned {
    /// What was known.
    pub scene: Scene,
    /// What could have been driven.
    pub candidates: CandidateSet,
    /// What each candidate costs under each term, in the term's unit.
    pub scores: Scores,
    /// Which one is taken, and why not another.
    pub verdict: Verdict,
}

/// Plans one cycle, whose number is `memory.seq`, with everything computed here: nothing is cut short and nothing is
/// missing. `elapsed` gives the time since the cycle began, which is told and changes nothing else.
pub fn plan(
    course: &Course,
    memory: &mut Memory,
    mission: &Mission,
    observation: &Observation,
    elapsed: &dyn Fn() -> Duration,
) -> (Decision, Planned) {
    plan_with(course, memory, mission, observation, None, elapsed)
}

/// As [`plan`], with the candidates of `own` if the profile's generator is a planner of one's own.
pub fn plan_with(
    course: &Course,
    memory: &mut Memory,
    mission: &Mission,
    observation: &Observation,
    own: Option<&mut dyn OwnPlanner>,
    elapsed: &dyn Fn() -> Duration,
) -> (Decision, Planned) {
    let scene = begin(course, memory, observation);
    let candidates = match own {
        Some(own) if course.asks_own() => course.ask_own(&scene, |input| own.candidates(mission, input)),
        _ => course.generate_all(&scene, &mut memory.carried),
    };
    let scores = course.score(&scene, &candidates);
    let verdict = choose(course, memory, &scene, &candidates, &scores);
    let active = course.profile.active_terms(scene.uncertain);
    let evaluated: BTreeMap<_, _> = active.map(|(term, _)| (term.to_owned(), Evaluated::Local)).collect();
    let elapsed_us = elapsed().as_micros() as u64;
    let decision =
        message::decision(memory.id(), &scene, &verdict.decision, evaluated, Vec::new(), elapsed_us);
    remember(memory, mission, &scene, &verdict);
    (decision, Planned { scene, candidates, scores, verdict })
}

/// Where a robot does not know its place, the decision is to look around; any other stays as it is.
pub fn look_around(
    decision: Decision,
    localising: &mut Localising,
    watch: &ObstacleWatch,
    belief: &Belief,
    mission: &Mission,
) -> Decision {
    if decision.reason != Reason::Localises {
        *localising = Localising::default();
        return decision;
    }
    let order = &mission.order;
    let robot = convert::robot_model(&order.robot_model);
    let Some(around) = watch.surroundings(order.laser.range_sigma) else { return decision };
    match localising.motion(decision.stamp, belief, &around, &robot) {
        Some(motion) => message::drive(decision, &motion, Localising::VALID_FOR),
        None => decision,
    }
}
