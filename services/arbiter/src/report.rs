//! What a cycle tells the world.

use std::collections::BTreeMap;
use std::sync::Arc;

use curionav_planning::arbitration::{self, Explanation, Lack, Previous, Scores, Verdict, explain};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::collision::{Collision, Obstacle};
use curionav_planning::evaluation::hccdm::{Component, Hccdm};
use curionav_planning::scene::Scene;
use curionav_planning::sight::Sight;
use curionav_planning::trajectory::Trajectory;
use curionav_runtime::convert;
use curionav_schemas::{
    self as wire, Action, Crowd, CycleReport, Decision, Degradation, Evaluated, F64Array, ObstacleCells,
    PreviousState, Reason, RejectedCandidate, Rejection, TermReport, Timings, Twist, U32Array,
};

use curionav_pool::context::PlanContext;

use crate::memory::DecisionId;

/// The decision as it goes to the driver.
pub(crate) fn decision(
    id: DecisionId,
    scene: &Scene,
    decision: &arbitration::Decision,
    evaluated: BTreeMap<String, Evaluated>,
    degraded: Vec<Degradation>,
    elapsed_us: u64,
) -> Decision {
    let trajectory = &decision.trajectory;
    let states = decision.trajectory.states();
    Decision {
        valid_for_s: decision.valid_for,
        action: match decision.action {
            arbitration::Action::Follow => Action::Follow,
            arbitration::Action::Hold => Action::Hold,
            arbitration::Action::Stop => Action::Stop,
        },
        arrived: decision.arrived,
        candidate: decision.candidate,
        x: states.x.as_slice().into(),
        y: states.y.as_slice().into(),
        heading: states.heading.as_slice().into(),
        v: states.v.as_slice().into(),
        omega: states.omega.as_slice().into(),
        uncertainty: scene.belief.uncertainty(),
        uncertain: scene.uncertain,
        evaluated,
        degraded,
        elapsed_us,
        ..standstill(id, (scene.tick, scene.stamp), trajectory.dt(), reason_to_wire(&decision.reason))
    }
}

/// A stop that no cycle led to: the mission is not running, or an input is missing.
pub(crate) fn stop(
    id: DecisionId,
    belief: &wire::Belief,
    dt: f64,
    reason: Reason,
    degraded: Option<Degradation>,
) -> Decision {
    Decision {
        uncertainty: belief.covariance.iter().step_by(4).sum(),
        degraded: degraded.into_iter().collect(),
        ..standstill(id, (belief.tick, belief.stamp), dt, reason)
    }
}

/// Gives a decision that stands this motion to drive instead.
pub(crate) fn drive(decision: Decision, motion: &Trajectory, valid_for_s: f64) -> Decision {
    let states = motion.states();
    Decision {
        action: Action::Follow,
        valid_for_s,
        dt: motion.dt(),
        x: states.x.as_slice().into(),
        y: states.y.as_slice().into(),
        heading: states.heading.as_slice().into(),
        v: states.v.as_slice().into(),
        omega: states.omega.as_slice().into(),
        ..decision
    }
}

fn standstill((epoch, seq): DecisionId, (tick, stamp): (u64, f64), dt: f64, reason: Reason) -> Decision {
    let none = F64Array::default;
    Decision {
        epoch,
        seq,
        tick,
        stamp,
        valid_for_s: 0.0,
        action: Action::Stop,
        reason,
        arrived: false,
        candidate: None,
        dt,
        x: none(),
        y: none(),
        heading: none(),
        v: none(),
        omega: none(),
        uncertainty: 0.0,
        uncertain: false,
        evaluated: BTreeMap::new(),
        degraded: Vec::new(),
        elapsed_us: 0,
    }
}

/// All that a cycle's report is made from: it is made only if something listens.
pub struct CycleOutcome {
    pub(crate) scene_message: wire::Scene,
    pub(crate) scene: Scene,
    pub(crate) candidates: CandidateSet,
    pub(crate) verdict: Verdict,
    pub(crate) scores: Scores,
    /// The decision before this one, as far as this cycle needed it.
    pub(crate) previous: Option<Previous>,
    /// Where the time went.
    pub timings: Timings,
    /// Planning ticks since the previous cycle that had none.
    pub gap: u64,
    pub(crate) driven: Option<Twist>,
}

impl CycleOutcome {
    /// The report of the cycle that ended in `decision`.
    pub fn report(self, context: &PlanContext, decision: Decision) -> CycleReport {
        let arbitration = context.course.arbitration(&self.scene, &self.candidates, self.previous.as_ref());
        let explanation = explain(&arbitration, &self.verdict);
        let profile = &context.course.profile;
        let terms = profile.terms.keys().map(|term| {
            let evaluated = decision.evaluated.get(term).copied();
            term_report(context, &self.verdict, &explanation, &self.scores, term, evaluated)
        });
        let terms = terms.collect();
        let course = &context.course;
        let hides = profile.sight.walls_hide;
        let sight = hides.then(|| Sight::new(Arc::clone(&course.map), course.robot.v_max));
        let crowds = Hccdm::build(
            &self.scene.people,
            &profile.hccdm,
            &profile.groups,
            sight.as_ref(),
            profile.steps,
            profile.dt,
        );
        let (scored, total) = with_cost(self.verdict.totals.total.iter().copied());
        let rejected = self.verdict.rejected.iter().enumerate().filter_map(|(i, rejection)| {
            Some(RejectedCandidate { candidate: i as u32, why: rejection_to_wire(rejection.as_ref()?) })
        });
        let obstacles = (!self.scene.obstacles.is_empty()).then(|| self.obstacles(context));
        CycleReport {
            robot: context.mission.order.robot.clone(),
            epoch: decision.epoch,
            seq: decision.seq,
            map: context.mission.order.map,
            scene: self.scene_message,
            candidates: convert::candidates_to_wire(&self.candidates),
            terms,
            scored,
            total,
            rejected: rejected.collect(),
            chosen: self.verdict.chosen.map(|i| i as u32),
            runner_up: explanation.runner_up.map(|i| i as u32),
            margin: explanation.margin,
            decision,
            timings: self.timings,
            crowds: crowds.components().iter().map(crowd).collect(),
            obstacles,
            driven: self.driven,
            gap: self.gap,
        }
    }

    /// What stands on no map, for those who do not have the map.
    fn obstacles(&self, context: &PlanContext) -> ObstacleCells {
        let course = &context.course;
        let grid = &course.map.grid;
        let centres = self.scene.obstacles.places(grid).map(|(column, row)| grid.centre(column, row));
        let (x, y): (Vec<f32>, Vec<f32>) = centres.map(|p| (p.x as f32, p.y as f32)).unzip();
        let here = self.scene.belief.pose.position();
        ObstacleCells {
            x: x.into(),
            y: y.into(),
            heading: grid.origin().heading,
            side: grid.resolution(),
            close_ways: course.geodesic.is_closed(here, context.mission.order.goal_tolerance),
        }
    }
}

fn crowd(component: &Component) -> Crowd {
    let Component { centre, variance, weight, members, .. } = component;
    Crowd { x: centre.x, y: centre.y, sigma: *variance, weight: *weight, members: members.len() as u32 }
}

/// The indices of the candidates that have a cost, and the costs.
fn with_cost(costs: impl Iterator<Item = Option<f64>>) -> (U32Array, F64Array) {
    let some = costs.enumerate().filter_map(|(i, cost)| Some((i as u32, cost?)));
    let (indices, costs): (Vec<u32>, Vec<f64>) = some.unzip();
    (indices.into(), costs.into())
}

/// What one term of the profile cost and wanted; `evaluated` is absent while its condition does not hold.
fn term_report(
    context: &PlanContext,
    verdict: &Verdict,
    explanation: &Explanation,
    scores: &Scores,
    term: &str,
    evaluated: Option<Evaluated>,
) -> TermReport {
    let (scored, raw) = with_cost((0..scores.len()).map(|i| scores.cost(term, i)));
    let costs = verdict.totals.terms.iter().find(|costs| costs.term == term);
    let (_, cost) = with_cost(costs.into_iter().flat_map(|costs| costs.cost.iter().copied()));
    let influence = explanation.terms.iter().find(|influence| influence.term == term);
    let index = |i: Option<usize>| i.map(|i| i as u32);
    let settings = &context.course.profile.terms[term];
    TermReport {
        term: term.to_owned(),
        weight: settings.weight,
        scale: settings.scale,
        active: evaluated.is_some(),
        evaluated: evaluated.unwrap_or(Evaluated::None),
        scored,
        raw,
        cost,
        alone: influence.and_then(|i| index(i.alone)),
        without: influence.and_then(|i| index(i.without)),
        doubled: influence.and_then(|i| index(i.doubled)),
        halved: influence.and_then(|i| index(i.halved)),
    }
}

fn reason_to_wire(reason: &arbitration::Reason) -> Reason {
    match reason {
        arbitration::Reason::Arrived => Reason::Arrived,
        arbitration::Reason::TurnsToHeading => Reason::TurnsToHeading,
        arbitration::Reason::WaitsForGoal => Reason::WaitsForGoal,
        arbitration::Reason::LeastCost => Reason::LeastCost,
        arbitration::Reason::LeastCostFree => Reason::LeastCostFree,
        arbitration::Reason::OnlySlowFree => Reason::OnlySlowFree,
        arbitration::Reason::Degraded { lack, previous } => {
            let previous = previous_to_wire(previous);
            match lack {
                Lack::NoCandidates => Reason::NoCandidates { previous },
                Lack::NotScored { term } => Reason::NotScored { term: term.clone(), previous },
                Lack::NoneFree => Reason::NoneFree { previous },
            }
        }
    }
}

fn previous_to_wire(previous: &arbitration::PreviousState) -> PreviousState {
    match *previous {
        arbitration::PreviousState::Held => PreviousState::Held,
        arbitration::PreviousState::Absent => PreviousState::Absent,
        arbitration::PreviousState::Expired => PreviousState::Expired,
        arbitration::PreviousState::Strayed { metres } => PreviousState::Strayed { distance_m: metres },
        arbitration::PreviousState::Collides(Collision { with, time: after_s, .. }) => match with {
            Obstacle::Wall => PreviousState::HitsWall { after_s },
            Obstacle::Person(person) => PreviousState::HitsPerson { person, after_s },
        },
    }
}

fn rejection_to_wire(rejection: &arbitration::Rejection) -> Rejection {
    match rejection {
        arbitration::Rejection::NotScored { term } => Rejection::NotScored { term: term.clone() },
        arbitration::Rejection::Unreachable { step } => Rejection::Unreachable { step: *step as u32 },
        arbitration::Rejection::Slow => Rejection::Slow,
        arbitration::Rejection::Collides(Collision { with, time: after_s, .. }) => match *with {
            Obstacle::Wall => Rejection::HitsWall { after_s: *after_s },
            Obstacle::Person(person) => Rejection::HitsPerson { person, after_s: *after_s },
        },
    }
}
