//! What must hold whatever fails, as far as it can be seen from outside; the numbers are those of
//! `faults/invariants.rs`.

use std::collections::BTreeMap;

use curionav_pool::context::PlanContext;
use curionav_schemas::{Action, Decision, Evaluated, Twist};

use super::recorder::{Record, Recorder};
use crate::faults::invariants::{HORIZON, UNCONTROLLED_MAX, true_cost};

/// Odometry is known every tenth of a second only.
const TICK_DISTANCE: f64 = 0.1;

/// Checks all that has been recorded. The map must be there to be fetched.
pub(super) fn check(recorder: &Recorder) {
    let context = recorder.context();
    let record = recorder.record();
    rising(&record);
    never_past_the_horizon(&record);
    under_control_or_soon_standing(&record);
    scored_by_every_metric_in_its_own_scene(&record, &context);
}

/// 1, no command from a decision past its horizon.
fn never_past_the_horizon(record: &Record) {
    let decisions: BTreeMap<(u64, u64), &Decision> =
        record.decisions.iter().map(|(_, d)| ((d.epoch, d.seq), d)).collect();
    for (_, command) in record.commands.iter().filter(|(_, c)| c.reason.follows()) {
        let Some(decision) = decisions.get(&(command.epoch, command.seq)) else { continue };
        let age = command.stamp - decision.stamp;
        assert!(age <= decision.valid_for_s.min(HORIZON) + 1e-9, "{age:.2} s old: {command:?}");
    }
}

/// 2, only what every metric has scored is followed, and 3, scores count for their own scene only: the cost
/// computed anew is the cost found, bit for bit.
fn scored_by_every_metric_in_its_own_scene(record: &Record, context: &PlanContext) {
    for (_, report) in record.reports.iter().filter(|(_, r)| r.decision.action == Action::Follow) {
        let decision = &report.decision;
        let terms: Vec<&str> =
            context.profile.active_terms(report.scene.uncertain).map(|(metric, _)| metric).collect();
        let by = |metric: &&str| decision.evaluated.get(*metric).copied().unwrap_or(Evaluated::None);
        assert!(terms.iter().all(|m| by(m) != Evaluated::None), "{decision:?}");
        assert_eq!((decision.tick, decision.stamp), (report.scene.tick, report.scene.stamp));
        let index = report.chosen.unwrap() as usize;
        let (total, by_term) = true_cost(context, report, index, &terms);
        assert_eq!(report.total_of(index), Some(total), "{terms:?} cost {by_term:?} in cycle {}", report.seq);
    }
}

/// 4, (epoch, seq) rises in what is obeyed. What is decided need not be obeyed: an arbiter that heard nothing of
/// the one before when it started begins with an epoch of its own.
fn rising(record: &Record) {
    let obeyed: Vec<_> = record.commands.iter().map(|(_, c)| (c.epoch, c.seq)).collect();
    assert!(obeyed.is_sorted(), "commands of decisions out of order");
}

/// 7, under control, or standing within the stopping distance from 1 m/s plus 0.3 s.
fn under_control_or_soon_standing(record: &Record) {
    let command_of: BTreeMap<u64, &Twist> = record.commands.iter().map(|(_, c)| (c.tick, c)).collect();
    let mut uncontrolled = 0.0;
    for pair in record.odometry.windows(2) {
        let (then, now) = (&pair[0].1, &pair[1].1);
        let followed = command_of.get(&then.tick).is_some_and(|c| c.reason.follows());
        let distance = ((now.x - then.x).powi(2) + (now.y - then.y).powi(2)).sqrt();
        uncontrolled = if followed || now.v == 0.0 { 0.0 } else { uncontrolled + distance };
        let most = UNCONTROLLED_MAX + TICK_DISTANCE;
        assert!(
            uncontrolled <= most,
            "{uncontrolled:.2} m without control at {:.1} s:{}",
            now.stamp,
            driven(record, &command_of, now.tick)
        );
    }
}

/// The ticks before `last` in a few words.
fn driven(record: &Record, command_of: &BTreeMap<u64, &Twist>, last: u64) -> String {
    let recent =
        record.odometry.iter().map(|(_, o)| o).filter(|o| (last.saturating_sub(35)..=last).contains(&o.tick));
    recent
        .map(|o| {
            let command = command_of.get(&o.tick).map(|c| (c.v, c.reason));
            format!("\ntick {}, at ({:.2}, {:.2}) with {:.2} m/s, told {command:?}", o.tick, o.x, o.y, o.v)
        })
        .collect()
}
