//! What a cycle tells the world.

use std::collections::BTreeMap;

use curionav_planning::arbitration::{self, Explanation, Scores, Verdict};
use curionav_planning::candidates::CandidateSet;
use curionav_planning::evaluation::hccdm::Hccdm;
use curionav_planning::scene::Scene;
use curionav_runtime::convert;
use curionav_schemas::{self as wire, Action, Crowd, CycleReport, Decision, Evaluated, TermReport, Timings};

use crate::context::PlanContext;

/// The decision as it goes to the driver.
pub(crate) fn decision(
    id: (u64, u64),
    scene: &Scene,
    decision: &arbitration::Decision,
    evaluated: BTreeMap<String, Evaluated>,
    degraded: Vec<String>,
    elapsed_us: u64,
) -> Decision {
    let trajectory = &decision.trajectory;
    Decision {
        epoch: id.0,
        seq: id.1,
        tick: scene.tick,
        stamp: scene.stamp,
        valid_for_s: decision.valid_for,
        action: match decision.action {
            arbitration::Action::Follow => Action::Follow,
            arbitration::Action::Hold => Action::Hold,
            arbitration::Action::Stop => Action::Stop,
        },
        reason: decision.reason.to_string(),
        arrived: decision.arrived,
        candidate: decision.candidate,
        dt: trajectory.dt(),
        x: trajectory.x().into(),
        y: trajectory.y().into(),
        heading: trajectory.heading().into(),
        v: trajectory.v().into(),
        omega: trajectory.omega().into(),
        uncertainty: scene.belief.uncertainty(),
        uncertain: scene.uncertain,
        evaluated,
        degraded,
        elapsed_us,
    }
}

/// A stop that no cycle led to: the mission is not running, or an input is missing.
pub fn stop(id: (u64, u64), belief: &wire::Belief, dt: f64, reason: &str, degraded: bool) -> Decision {
    let none = wire::F64Array::default;
    Decision {
        epoch: id.0,
        seq: id.1,
        tick: belief.tick,
        stamp: belief.stamp,
        valid_for_s: 0.0,
        action: Action::Stop,
        reason: reason.to_owned(),
        arrived: false,
        candidate: None,
        dt,
        x: none(),
        y: none(),
        heading: none(),
        v: none(),
        omega: none(),
        uncertainty: belief.covariance.iter().step_by(4).sum(),
        uncertain: false,
        evaluated: BTreeMap::new(),
        degraded: if degraded { vec![reason.to_owned()] } else { Vec::new() },
        elapsed_us: 0,
    }
}

/// The full account of a cycle.
#[expect(clippy::too_many_arguments, reason = "one argument a part of the report")]
pub(crate) fn cycle(
    context: &PlanContext,
    scene_message: wire::Scene,
    scene: &Scene,
    candidates: &CandidateSet,
    verdict: &Verdict,
    explanation: &Explanation,
    scores: &Scores,
    decision: Decision,
    timings: Timings,
    gap: u64,
) -> CycleReport {
    let terms = context.profile.terms.keys().map(|metric| {
        let evaluated = decision.evaluated.get(metric).copied();
        term(context, verdict, explanation, scores, metric, evaluated)
    });
    let crowds =
        Hccdm::build(&scene.people, &context.profile.hccdm, context.profile.steps, context.profile.dt);
    CycleReport {
        robot: context.mission.robot.clone(),
        epoch: decision.epoch,
        seq: decision.seq,
        map: context.mission.map,
        scene: scene_message,
        candidates: convert::candidates_to_wire(candidates),
        terms: terms.collect(),
        total: verdict.totals.total.iter().map(|t| t.unwrap_or(0.0)).collect(),
        rejected: verdict
            .rejected
            .iter()
            .map(|r| r.as_ref().map(ToString::to_string).unwrap_or_default())
            .collect(),
        chosen: verdict.chosen.map(|i| i as u32),
        runner_up: explanation.runner_up.map(|i| i as u32),
        margin: explanation.margin,
        decision,
        timings,
        crowds: crowds
            .components()
            .iter()
            .map(|c| Crowd {
                x: c.centre.x,
                y: c.centre.y,
                sigma: c.variance,
                weight: c.weight,
                members: c.members.len() as u32,
            })
            .collect(),
        gap,
    }
}

/// What one term of the profile cost and wanted; `evaluated` is absent while its condition does not hold.
fn term(
    context: &PlanContext,
    verdict: &Verdict,
    explanation: &Explanation,
    scores: &Scores,
    metric: &str,
    evaluated: Option<Evaluated>,
) -> TermReport {
    let missing = scores.missing(metric);
    let some = !scores.is_empty() && missing.len() < scores.len();
    let raw = (0..scores.len()).filter(|_| some).map(|i| scores.cost(metric, i).unwrap_or(0.0));
    let costs = verdict.totals.terms.iter().find(|term| term.metric == metric).filter(|_| some);
    let influence = explanation.terms.iter().find(|term| term.metric == metric);
    let index = |i: Option<usize>| i.map(|i| i as u32);
    let settings = &context.profile.terms[metric];
    TermReport {
        metric: metric.to_owned(),
        weight: settings.weight,
        scale: settings.scale,
        active: evaluated.is_some(),
        raw: raw.collect(),
        evaluated: evaluated.unwrap_or(Evaluated::None),
        cost: costs.map(|c| c.cost.iter().map(|c| c.unwrap_or(0.0)).collect()).unwrap_or_default(),
        missing: missing.iter().filter(|_| some).map(|&i| i as u32).collect(),
        alone: influence.and_then(|i| index(i.alone)),
        without: influence.and_then(|i| index(i.without)),
        doubled: influence.and_then(|i| index(i.doubled)),
        halved: influence.and_then(|i| index(i.halved)),
    }
}
