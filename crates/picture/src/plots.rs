//! What changed over time: uncertainty, error, distance to people, speed.

use super::axes::Scale;
use super::chart::{Chart, Curve};
use super::page::{Panel, translate};
use super::palette::{BELIEF, PERSON, TRUTH};
use super::run::Run;
use super::snapshots::{Snapshot, turn};
use super::trace_columns::TraceColumns;
use curionav_schemas::CycleReport;
use svg::node::element::Group;

/// Comfortable distance between centres, which TD and NT count by, m.
const COMFORT_M: f64 = 1.5;
/// Farther people are off the plot, m.
const FAR_M: f64 = 8.0;
/// Upper end of an axis over the greatest value: room for the numbers of the snapshots.
const HEADROOM: f64 = 1.16;
/// Smallest uncertainty told apart on a logarithmic axis.
const LEAST_UNCERTAINTY: f64 = 1e-5;
/// Between two plots beside each other, and height of a plot with its title and numbers, px.
const GAP: f64 = 24.0;
const HEIGHT: f64 = 172.0;

/// The four plots, two beside each other, `width` pixels in all.
pub(super) fn plots(run: &Run<'_>, trace: &TraceColumns, snapshots: &[Snapshot<'_>], width: f64) -> Panel {
    let each = (width - GAP) / 2.0;
    let time = (trace.time.first().copied().unwrap_or(0.0), trace.time.last().copied().unwrap_or(1.0));
    let uncertain = uncertain(run.reports, time.1);
    let chart = |title, scale, values: Vec<f64>, colour, levels| Chart {
        title,
        scale,
        across: time,
        unit: "s",
        ticks: 12,
        uncertain: &uncertain,
        snapshots,
        levels,
        curves: vec![Curve { colour, width: 1.6, points: trace.time.iter().copied().zip(values).collect() }],
    };
    let uncertainty: Vec<f64> = trace.uncertainty.iter().map(|v| v.max(LEAST_UNCERTAINTY)).collect();
    let least = uncertainty.iter().copied().fold(f64::INFINITY, f64::min).min(1.0);
    let near: Vec<f64> =
        trace.person_distance.iter().map(|d| if *d < 100.0 { *d } else { f64::NAN }).collect();
    let slowest = trace.speed.iter().copied().fold(0.0, f64::min);
    let charts = [
        chart(
            "Uncertainty: trace of the pose covariance, m\u{b2} + rad\u{b2} (shaded: counts as uncertain)",
            Scale::logarithmic(least / 1.2, most(&uncertainty).max(2.0 * least) * 2.0),
            uncertainty,
            BELIEF,
            thresholds(run.reports),
        ),
        chart(
            "Distance to the nearest person, centre to centre, m",
            Scale::linear(0.0, (most(&near) * HEADROOM).clamp(2.0 * COMFORT_M, FAR_M)),
            near,
            PERSON,
            vec![(COMFORT_M, format!("{COMFORT_M} m"))],
        ),
        chart(
            "Localisation error: distance of the estimate from the truth, m",
            Scale::linear(0.0, (most(&trace.error) * HEADROOM).max(0.1)),
            trace.error.clone(),
            BELIEF,
            Vec::new(),
        ),
        chart(
            "Speed, m/s",
            Scale::linear(slowest * 1.08, (most(&trace.speed) * HEADROOM).max(0.1)),
            trace.speed.clone(),
            TRUTH,
            Vec::new(),
        ),
    ];
    let mut content = Group::new();
    for (index, chart) in charts.iter().enumerate() {
        let at = translate((index % 2) as f64 * (each + GAP), (index / 2) as f64 * HEIGHT);
        content = content.add(chart.draw((each, HEIGHT)).set("transform", at));
    }
    Panel { content, width, height: charts.len().div_ceil(2) as f64 * HEIGHT }
}

/// Where localisation was seen to settle and to be lost: each lies between the uncertainties of two cycles.
fn thresholds(reports: &[CycleReport]) -> Vec<(f64, String)> {
    let turns = [(true, "settles"), (false, "lost")].into_iter().filter_map(|(settles, name)| {
        let after = turn(reports, settles)?;
        let [before, after] =
            [after - 1, after].map(|i| reports[i].decision.uncertainty.max(LEAST_UNCERTAINTY));
        let level = (before * after).sqrt();
        Some((level, format!("{name} near {level:.2}")))
    });
    turns.collect()
}

/// The greatest finite value, or 0.
fn most(values: &[f64]) -> f64 {
    values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max)
}

fn uncertain(reports: &[CycleReport], end: f64) -> Vec<(f64, f64)> {
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for (index, report) in reports.iter().enumerate().filter(|(_, report)| report.scene.uncertain) {
        let from = report.scene.stamp;
        let to = reports.get(index + 1).map_or(end, |next| next.scene.stamp);
        match spans.last_mut() {
            Some((_, until)) if *until >= from => *until = to,
            _ => spans.push((from, to)),
        }
    }
    spans
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    fn report(stamp: f64, uncertain: bool, uncertainty: f64) -> CycleReport {
        let mut report = golden::cycle_report();
        report.scene.stamp = stamp;
        report.scene.uncertain = uncertain;
        report.decision.uncertainty = uncertainty;
        report
    }

    #[test]
    fn neighbouring_uncertain_cycles_are_one_span() {
        let reports = [true, true, false, true].map(|uncertain| report(0.0, uncertain, 0.1));
        let reports: Vec<_> = reports
            .into_iter()
            .enumerate()
            .map(|(i, mut report)| {
                report.scene.stamp = i as f64;
                report
            })
            .collect();
        assert_eq!(uncertain(&reports, 5.0), [(0.0, 2.0), (3.0, 5.0)]);
    }

    #[test]
    fn a_threshold_lies_between_the_cycles_around_the_turn() {
        let reports = [report(0.0, true, 0.4), report(0.3, false, 0.1), report(0.6, false, 0.09)];
        // The geometric mean of 0.4 and 0.1.
        assert_eq!(thresholds(&reports), [(0.2, "settles near 0.20".to_owned())]);
        assert!(thresholds(&reports[1..]).is_empty());
    }
}
