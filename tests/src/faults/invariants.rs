//! What only the simulated world can see of the invariants, beside what `crate::invariants` checks. Each violation is
//! told with the seed that replays it.

use curionav_pool::pool::Pool;
use curionav_robot::driver::decision_fence::SILENCE;
use curionav_schemas::{CycleReport, Decision};

use super::base::TICK;
use super::replica::QUEUE;
use super::world::{SimulatedPeers, State, World};
use crate::invariants::{BOUNDED, HEALED, RISING};

/// Metres from its trajectory at which a robot still counts as following it.
const STRAYED_MAX: f64 = 0.8;
/// Tasks and timers of a world, messages under way included.
const LOAD_MAX: usize = 300;
/// Messages that the driver keeps.
const WAITING_MAX: usize = 200;
/// Cycles after which everything is as it should be once nothing is wrong any more, and how long these take.
pub(super) const HEALING: f64 = 5.0 * 0.3;

/// After each tick of the robot: what was commanded, and how far it went.
pub(super) fn after_a_tick(world: &World) {
    let load = world.executor.load();
    let State { robot, replicas, checker, .. } = &mut *world.state();
    let Some(tick) = robot.driven.last() else { return };
    tick.command.iter().for_each(|command| {
        checker.commanded(command);
    });
    let on_its_way = tick.command.as_ref().filter(|_| tick.strayed <= STRAYED_MAX);
    checker.moved(tick.now, tick.distance, tick.v, on_its_way);
    let queued = replicas.values().map(|r| r.queue.waiting()).max().unwrap_or(0);
    let waiting = robot.waiting();
    let small = load.0.max(load.1) <= LOAD_MAX && queued <= QUEUE && waiting <= WAITING_MAX;
    checker.violations.check(small, BOUNDED, || {
        format!("{load:?} tasks and timers, {queued} queued, {waiting} with the driver")
    });
    checker.violations.assert_none();
}

/// After each cycle: what was decided, from what.
pub(super) fn after_a_cycle(
    world: &World,
    pool: &Pool<SimulatedPeers>,
    arbiter: u64,
    decision: &Decision,
    report: Option<&CycleReport>,
) {
    let known = pool.replicas().known();
    let State { replicas, epochs, checker, .. } = &mut *world.state();
    checker.decided(decision);
    report.into_iter().for_each(|report| checker.reported(report));
    let all = replicas.len();
    checker.violations.check(known <= all, BOUNDED, || format!("{known} of {all} replicas known"));
    let owner = *epochs.entry(decision.epoch).or_insert(arbiter);
    let of_one = owner == arbiter;
    checker.violations.check(of_one, RISING, || format!("two arbiters share epoch {}", decision.epoch));
    checker.violations.assert_none();
}

/// At the end: what was obeyed in which order, and whether all was well once nothing was wrong any more.
pub(super) fn at_the_end(world: &World, healed: f64) {
    let State { robot, checker, .. } = &mut *world.state();
    let violations = &mut checker.violations;
    for pair in robot.taken.windows(2) {
        let [(then, life_then, before), (now, life, after)] = pair else { unreachable!("windows of two") };
        let rises = before.epoch == after.epoch && before.seq < after.seq;
        let was_silent = now - then > SILENCE - TICK || life != life_then;
        let ids = [(before.epoch, before.seq), (after.epoch, after.seq)];
        violations.check(rises || was_silent, RISING, || format!("{ids:?} at {then:.1} and {now:.1} s"));
    }
    let after: Vec<_> = robot.taken.iter().filter(|(_, _, d)| d.stamp > healed + HEALING).collect();
    let due = ((robot.base.now() - healed - HEALING) / 0.3) as usize;
    let obeyed = after.len();
    violations
        .check(obeyed + 1 >= due, HEALED, || format!("{obeyed} decisions obeyed of {due} that were due"));
    for (now, _, decision) in after {
        violations.check(decision.degraded.is_empty(), HEALED, || {
            format!("at {now:.1} s, healed at {healed:.1} s: {:?}", decision.degraded)
        });
    }
    violations.assert_none();
    assert_eq!(checker.unseen, 0, "decisions are followed that no arbiter has made");
}
