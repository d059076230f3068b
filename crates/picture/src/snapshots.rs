//! Which planning cycles are worth a picture of their own.

use super::trace_columns::TraceColumns;
use curionav_schemas::{Action, CycleReport};

/// Snapshots shown: two rows of three.
const MOST: usize = 6;
/// A person farther away than this does not count as near, m.
const NEAR_M: f64 = 20.0;

#[derive(Debug, Clone, Copy)]
pub(super) struct Snapshot<'a> {
    pub(super) number: usize,
    pub(super) label: &'static str,
    pub(super) report: &'a CycleReport,
    /// Row of the trace.
    pub(super) row: usize,
}

/// At most six cycles, in the order of time: those at which something happened, then some at even distances.
pub(super) fn snapshots<'a>(reports: &'a [CycleReport], trace: &TraceColumns) -> Vec<Snapshot<'a>> {
    let Some(last) = reports.len().checked_sub(1) else { return Vec::new() };
    let apart = (reports.len() / 40).max(1);
    let share = |share: f64| Some((last as f64 * share).round() as usize);
    let wishes = [
        (Some(0), "start"),
        (turn(reports, true), "localisation has settled"),
        (closest(reports, trace), "closest to a person"),
        (Some(reports.iter().rposition(|r| !r.decision.arrived).unwrap_or(last)), "end"),
        (unusual(reports), "first hold or stop"),
        (turn(reports, false), "localisation lost again"),
        (share(0.5), "half-way"),
        (share(0.25), "a quarter of the way"),
        (share(0.75), "three quarters of the way"),
        (share(0.125), "soon after the start"),
        (share(0.375), "before half-way"),
        (share(0.625), "after half-way"),
        (share(0.875), "towards the end"),
    ];
    let mut picked: Vec<(usize, &'static str)> = Vec::new();
    for (index, label) in wishes.into_iter().filter_map(|(index, label)| Some((index?, label))) {
        if picked.len() < MOST && picked.iter().all(|(other, _)| other.abs_diff(index) >= apart) {
            picked.push((index, label));
        }
    }
    picked.sort_unstable();
    let snapshots = (1..).zip(picked).map(|(number, (index, label))| {
        let report = &reports[index];
        Snapshot { number, label, report, row: trace.row_at(report.scene.stamp) }
    });
    snapshots.collect()
}

/// The first cycle at which localisation stops (`settles`) or starts to count as uncertain.
pub(super) fn turn(reports: &[CycleReport], settles: bool) -> Option<usize> {
    let mut pairs = reports.windows(2).map(|pair| (pair[0].scene.uncertain, pair[1].scene.uncertain));
    pairs.position(|turn| turn == (settles, !settles)).map(|index| index + 1)
}

/// The cycle before the robot came closest to a person.
fn closest(reports: &[CycleReport], trace: &TraceColumns) -> Option<usize> {
    let near = trace.person_distance.iter().zip(&trace.time).filter(|(distance, _)| **distance < NEAR_M);
    let (_, time) = near.min_by(|a, b| a.0.total_cmp(b.0))?;
    Some(reports.partition_point(|report| report.scene.stamp <= *time).saturating_sub(1))
}

/// The first cycle that did not end in following a candidate, before arrival.
fn unusual(reports: &[CycleReport]) -> Option<usize> {
    reports.iter().position(|r| r.decision.action != Action::Follow && !r.decision.arrived)
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    fn reports(count: usize, settles_at: usize) -> Vec<CycleReport> {
        (0..count)
            .map(|i| {
                let mut report = golden::cycle_report();
                report.scene.stamp = 0.3 * i as f64;
                report.scene.uncertain = i < settles_at;
                report
            })
            .collect()
    }

    #[test]
    fn no_cycle_no_snapshot_and_one_cycle_one_snapshot() {
        assert!(snapshots(&[], &TraceColumns::default()).is_empty());
        assert_eq!(snapshots(&reports(1, 0), &TraceColumns::default()).len(), 1);
    }

    #[test]
    fn what_happened_is_shown_in_the_order_of_time() {
        let mut reports = reports(100, 12);
        reports[70].decision = golden::stop();
        let time: Vec<f64> = (0..300).map(|i| 0.1 * f64::from(i)).collect();
        let person_distance = time.iter().map(|t| 1.0 + (t - 15.0).abs()).collect();
        let trace = TraceColumns { time, person_distance, ..TraceColumns::default() };
        let shown = snapshots(&reports, &trace);
        let seen: Vec<_> = shown.iter().map(|m| (m.number, m.label, m.report.scene.stamp.round())).collect();
        // The closest approach, at 15 s, takes the place of half-way.
        assert_eq!(
            seen,
            [
                (1, "start", 0.0),
                (2, "localisation has settled", 4.0),
                (3, "a quarter of the way", 8.0),
                (4, "closest to a person", 15.0),
                (5, "first hold or stop", 21.0),
                (6, "end", 30.0),
            ]
        );
    }
}
