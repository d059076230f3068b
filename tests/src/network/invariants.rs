//! The invariants of `crate::invariants`, checked in what was recorded.

use std::collections::BTreeMap;
use std::sync::Arc;

use curionav_schemas::Twist;

use super::recorder::Recorder;
use crate::invariants::Checker;

/// Odometry is known every tenth of a second only, in which a robot goes so many metres.
const TICK_DISTANCE: f64 = 0.1;

/// Checks all that has been recorded. The map must be there to be fetched.
pub(super) fn check(recorder: &Recorder) {
    let mut checker =
        Checker::new("recorded", vec![Arc::new(recorder.context(recorder.mission()))], TICK_DISTANCE);
    let record = recorder.record();
    record.decisions.iter().for_each(|(_, decision)| checker.decided(decision));
    record.reports.iter().for_each(|(_, report)| checker.reported(report));
    record.commands.iter().for_each(|(_, command)| {
        checker.commanded(command);
    });
    let command_of: BTreeMap<u64, &Twist> = record.commands.iter().map(|(_, c)| (c.tick, c)).collect();
    for pair in record.odometry.windows(2) {
        let (then, now) = (&pair[0].1, &pair[1].1);
        let metres = (now.x - then.x).hypot(now.y - then.y);
        checker.moved(now.stamp, metres, now.v, command_of.get(&then.tick).copied());
    }
    checker.violations.assert_none();
    assert!(checker.has_seen_enough(), "{} of {} decisions unseen", checker.unseen, checker.followed);
}
