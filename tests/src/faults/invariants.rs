//! What must hold whatever fails. Each check names its invariant and the seed that replays it.

use std::collections::BTreeMap;
use std::sync::Arc;

use curionav_planning::arbitration::{Scores, total_costs};
use curionav_pool::context::PlanContext;
use curionav_pool::pool::Pool;
use curionav_runtime::convert;
use curionav_schemas::{Action, CommandReason, CycleReport, Decision, Evaluated};

use super::replica::QUEUE;
use super::world::{SimulatedPeers, World};

/// Metres a robot may go that nothing controls: to a stand from 1 m/s at 0.5 m/s2, and 0.3 s before.
pub(crate) const UNCONTROLLED_MAX: f64 = 1.0 + 0.3;
/// Metres from its trajectory at which a robot still counts as following it.
pub(crate) const STRAYED_MAX: f64 = 0.8;
/// Tasks and timers of a world, messages under way included.
const LOAD_MAX: usize = 300;
/// Longest a decision may be followed (`hold.max_age` of the profile), seconds.
pub(crate) const HORIZON: f64 = 1.2;
/// Cycles after which everything is as it should be once nothing is wrong any more, and how long these take.
pub(super) const HEALING: f64 = 5.0 * 0.3;

fn check(world: &World, holds: bool, invariant: &str, what: impl FnOnce() -> String) {
    assert!(holds, "invariant {invariant}; seed {}: {}", world.mission.order.seed, what());
}

/// After each tick of the robot: what was commanded, and how far it went.
pub(super) fn after_a_tick(world: &Arc<World>) {
    let load = world.executor.load();
    let queued = world.state().replicas.values().map(|r| r.queue.waiting()).max().unwrap_or(0);
    let mut state = world.state();
    let robot = &mut state.robot;
    let Some(tick) = robot.driven.last().cloned() else { return };
    let follows = tick.reason.is_some_and(CommandReason::follows);
    if follows {
        let (_, stamp, valid_for) = tick.obeyed.unwrap_or_default();
        // The command was given at the start of the tick.
        let age = tick.now - super::base::TICK - stamp;
        check(
            world,
            age <= valid_for.min(HORIZON) + 1e-9,
            "1, no command from a decision past its horizon",
            || format!("{age:.2} s old at {:.1} s", tick.now),
        );
    }
    let controlled = follows && tick.strayed <= STRAYED_MAX;
    robot.uncontrolled = if controlled || tick.v == 0.0 { 0.0 } else { robot.uncontrolled + tick.distance };
    check(world, robot.uncontrolled <= UNCONTROLLED_MAX, "7, under control or soon standing", || {
        format!("{:.2} m at {:.1} s: {:?}", robot.uncontrolled, tick.now, tick)
    });
    let waiting = robot.waiting();
    let small = load.0 <= LOAD_MAX && load.1 <= LOAD_MAX && queued <= QUEUE && waiting <= 200;
    check(world, small, "8, nothing grows without bound", || {
        format!("{load:?} tasks and timers, {queued} queued, {waiting} with the driver")
    });
}

/// After each cycle: what was decided, from what.
pub(super) fn after_a_cycle(
    world: &Arc<World>,
    context: &PlanContext,
    pool: &Pool<SimulatedPeers>,
    arbiter: u64,
    decision: &Decision,
    report: Option<&CycleReport>,
) {
    let (known, all) = (pool.replicas().len(), world.state().replicas.len());
    check(world, known <= all, "8, nothing grows without bound", || {
        format!("{known} of {all} replicas known")
    });
    {
        let mut state = world.state();
        let owner = *state.epochs.entry(decision.epoch).or_insert(arbiter);
        check(world, owner == arbiter, "4, no two arbiters share an epoch", || format!("{}", decision.epoch));
    }
    let Some(report) = report else { return };
    let most = context.profile.trees * context.profile.max_candidates();
    check(world, report.candidates.count <= most, "8, nothing grows without bound", || "candidates".into());
    if decision.action != Action::Follow {
        return;
    }
    let terms: Vec<&str> =
        context.profile.active_terms(report.scene.uncertain).map(|(metric, _)| metric).collect();
    let scored = terms.iter().all(|m| decision.evaluated.get(*m).is_some_and(|how| *how != Evaluated::None));
    check(world, scored, "2, only what every metric has scored is followed", || format!("{decision:?}"));
    let index = report.chosen.unwrap() as usize;
    let (total, by_term) = true_cost(context, report, index, &terms);
    let found = report.total_of(index).unwrap();
    let lacks = by_term.iter().any(|cost| (found - (total - cost)).abs() < 1e-9 && *cost > 1e-6);
    check(world, !lacks, "2, only what every metric has scored is followed", || {
        format!("cost {found} of {total}: {by_term:?}")
    });
    check(world, found == total, "3, scores count for their own scene only", || {
        format!("cost {found} instead of {total}, cycle {}", decision.seq)
    });
    let of_scene = (decision.tick, decision.stamp) == (report.scene.tick, report.scene.stamp);
    check(world, of_scene, "3, scores count for their own scene only", || "decision of another scene".into());
}

/// What a candidate costs in the scene of its report, whole and by term, computed anew.
pub(crate) fn true_cost(
    context: &PlanContext,
    report: &CycleReport,
    index: usize,
    terms: &[&str],
) -> (f64, Vec<f64>) {
    let scene = convert::scene(&report.scene).unwrap();
    let candidate = convert::candidates(report.candidates.clone()).unwrap().pick(&[index]);
    let mut scores = Scores::new(1);
    for term in terms {
        let cost = match context.local(term) {
            Some(evaluator) => evaluator.evaluate(&scene, &candidate, &|| false).unwrap(),
            // A term that is not built in cannot be computed anew here.
            None => vec![report.terms.iter().find(|t| t.term == *term).unwrap().raw_of(index).unwrap()],
        };
        scores.insert(term, 0, &cost).unwrap();
    }
    let totals = total_costs(&context.profile, scene.uncertain, candidate.steps(), &scores);
    let by_term = totals.terms.iter().map(|term| term.cost[0].unwrap()).collect();
    (totals.total[0].unwrap(), by_term)
}

/// At the end: who was obeyed in which order, and whether all was well once nothing was wrong any more.
pub(super) fn at_the_end(world: &Arc<World>, healed: f64) {
    let state = world.state();
    let mut newest: BTreeMap<u64, (u64, u64)> = BTreeMap::new();
    for (now, life, decision) in &state.robot.taken {
        let id = (decision.epoch, decision.seq);
        let before = newest.insert(*life, id);
        check(world, before.is_none_or(|before| before < id), "4, (epoch, seq) rises", || {
            format!("{id:?} after {before:?} at {now:.1} s")
        });
    }
    let after: Vec<_> = state.robot.taken.iter().filter(|(_, _, d)| d.stamp > healed + HEALING).collect();
    let due = ((state.robot.base.now() - healed - HEALING) / 0.3) as usize;
    check(world, after.len() + 1 >= due, "5, nominal within 5 cycles of healing", || {
        format!("{} decisions obeyed of {due} that were due", after.len())
    });
    for (now, _, decision) in after {
        check(world, decision.degraded.is_empty(), "5, nominal within 5 cycles of healing", || {
            format!("at {now:.1} s, healed at {healed:.1} s: {:?}", decision.degraded)
        });
    }
}
