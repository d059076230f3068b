//! What a cycle tells the world.

use std::sync::Arc;

use curionav_planning::arbitration::{self, Explanation, Previous, Scores, Verdict, explain};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::collision::{Collision, Obstacle};
use curionav_planning::evaluation::hccdm::{Component, Hccdm};
use curionav_planning::scene::Scene;
use curionav_planning::sight::Sight;
use curionav_runtime::convert;
use curionav_schemas::{
    self as wire, Crowd, CycleReport, Decision, Evaluated, F64Array, ObstacleCells, RejectedCandidate,
    Rejection, TermReport, Timings, Twist, U32Array,
};

use curionav_pool::context::PlanContext;

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
