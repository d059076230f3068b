//! What changed over time: uncertainty, error, distance to people, speed.

use super::axes::{Scale, frame, label, ticks};
use super::page::Panel;
use super::palette::{BELIEF, INK, PERSON, QUIET, TRUTH, UNCERTAIN};
use super::run::Run;
use super::snapshots::Snapshot;
use super::symbols::{line, text};
use super::viewport::px;
use curionav_schemas::CycleReport;
use svg::node::element::{Group, Polyline, Rectangle, SVG};

/// Comfortable distance between centres, which TD and NT count by, m.
const COMFORT_M: f64 = 1.5;
/// Farther people are off the plot, m.
const FAR_M: f64 = 8.0;
/// Upper end of an axis over the greatest value: room for the numbers of the snapshots.
const HEADROOM: f64 = 1.16;
/// Smallest uncertainty told apart on a logarithmic axis.
const LEAST_UNCERTAINTY: f64 = 1e-5;
/// Room left of and around a plot, px.
const AXIS: f64 = 34.0;
const TOP: f64 = 22.0;
const BOTTOM: f64 = 24.0;

/// One quantity over time.
struct Plot<'a> {
    title: &'static str,
    /// `[row]`; those that are not finite are gaps.
    values: Vec<f64>,
    colour: &'a str,
    scale: Scale,
    /// Levels to compare with, and what they are.
    levels: Vec<(f64, String)>,
}

/// The four plots, two beside each other, `width` pixels in all.
pub(super) fn plots(run: &Run<'_>, snapshots: &[Snapshot<'_>], width: f64) -> Panel {
    const GAP: f64 = 24.0;
    const HEIGHT: f64 = 126.0;
    let each = (width - GAP) / 2.0;
    let mut content = Group::new();
    let all = quantities(run);
    let rows = all.len().div_ceil(2);
    for (index, plot) in all.iter().enumerate() {
        let (column, row) = ((index % 2) as f64, (index / 2) as f64);
        let at = format!("translate({} {})", px(column * (each + GAP)), px(row * (HEIGHT + TOP + BOTTOM)));
        content = content.add(drawn(plot, run, snapshots, each, HEIGHT).set("transform", at));
    }
    Panel { content, width, height: rows as f64 * (HEIGHT + TOP + BOTTOM) }
}

fn quantities<'a>(run: &Run<'_>) -> Vec<Plot<'a>> {
    let trace = &run.trace;
    let most = |values: &[f64]| values.iter().copied().filter(|v| v.is_finite()).fold(0.0, f64::max);
    let uncertainty: Vec<f64> = trace.uncertainty.iter().map(|v| v.max(LEAST_UNCERTAINTY)).collect();
    let least = uncertainty.iter().copied().fold(f64::INFINITY, f64::min).min(1.0);
    let near: Vec<f64> =
        trace.person_distance.iter().map(|d| if *d < 100.0 { *d } else { f64::NAN }).collect();
    let slowest = trace.speed.iter().copied().fold(0.0, f64::min);
    vec![
        Plot {
            title: "Uncertainty: trace of the pose covariance, m\u{b2} + rad\u{b2} (shaded: counts as uncertain)",
            scale: Scale::logarithmic(least / 1.2, most(&uncertainty).max(2.0 * least) * 2.0),
            values: uncertainty,
            colour: BELIEF,
            levels: thresholds(run.reports),
        },
        Plot {
            title: "Distance to the nearest person, centre to centre, m",
            scale: Scale::linear(0.0, (most(&near) * HEADROOM).clamp(2.0 * COMFORT_M, FAR_M)),
            values: near,
            colour: PERSON,
            levels: vec![(COMFORT_M, format!("{COMFORT_M} m"))],
        },
        Plot {
            title: "Localisation error: distance of the estimate from the truth, m",
            scale: Scale::linear(0.0, (most(&trace.error) * HEADROOM).max(0.1)),
            values: trace.error.clone(),
            colour: BELIEF,
            levels: Vec::new(),
        },
        Plot {
            title: "Speed, m/s",
            scale: Scale::linear(slowest * 1.08, (most(&trace.speed) * HEADROOM).max(0.1)),
            values: trace.speed.clone(),
            colour: TRUTH,
            levels: Vec::new(),
        },
    ]
}

/// Where localisation was seen to settle and to be lost: each lies between the uncertainties of two cycles.
fn thresholds(reports: &[CycleReport]) -> Vec<(f64, String)> {
    let level = |settles: bool| {
        let turns =
            |pair: &&[CycleReport]| pair[0].scene.uncertain == settles && pair[1].scene.uncertain != settles;
        let pair = reports.windows(2).find(turns)?;
        let [before, after] = [0, 1].map(|i| pair[i].decision.uncertainty.max(LEAST_UNCERTAINTY));
        Some((before * after).sqrt())
    };
    let named =
        |level: Option<f64>, name: &str| level.map(|level| (level, format!("{name} near {level:.2}")));
    named(level(true), "settles").into_iter().chain(named(level(false), "lost")).collect()
}

fn drawn(plot: &Plot<'_>, run: &Run<'_>, snapshots: &[Snapshot<'_>], width: f64, height: f64) -> Group {
    let wide = width - AXIS;
    let time = &run.trace.time;
    let (from, to) = (time.first().copied().unwrap_or(0.0), time.last().copied().unwrap_or(1.0));
    let x = |t: f64| wide * (t - from) / (to - from).max(1e-6);
    let y = |value: f64| height * (1.0 - plot.scale.share(value));
    let mut inside = SVG::new().set("width", px(wide)).set("height", px(height));
    for (start, end) in uncertain(run.reports, to) {
        inside = inside.add(
            Rectangle::new()
                .set("x", px(x(start)))
                .set("width", px(x(end) - x(start)))
                .set("height", px(height))
                .set("fill", UNCERTAIN)
                .set("fill-opacity", 0.28),
        );
    }
    let mut outside = Group::new().add(text((0.0, -7.0), "b", plot.title));
    for value in plot.scale.ticks() {
        inside = inside.add(line((0.0, y(value)), (wide, y(value)), "grid"));
        outside = outside.add(text((-6.0, y(value) + 3.5), "s", label(value)).set("text-anchor", "end"));
    }
    for value in ticks(from, to, 12) {
        inside = inside.add(line((x(value), 0.0), (x(value), height), "grid"));
        outside = outside.add(line((x(value), height), (x(value), height + 4.0), "tick")).add(
            text((x(value), height + 15.0), "s", format!("{} s", label(value))).set("text-anchor", "middle"),
        );
    }
    for snapshot in snapshots {
        let at = x(snapshot.report.scene.stamp);
        let mark = line((at, 0.0), (at, height), "line").set("stroke", INK).set("stroke-width", 0.8);
        inside = inside.add(mark.set("stroke-dasharray", "2 3").set("stroke-opacity", 0.7));
        // Beside its line, on the side that is within the plot.
        let beside = if at < wide - 12.0 { at + 3.0 } else { at - 9.0 };
        let number = text((beside, 10.0), "s b halo", snapshot.number.to_string());
        inside = inside.add(number);
    }
    for (value, name) in &plot.levels {
        let level = line((0.0, y(*value)), (wide, y(*value)), "line").set("stroke", QUIET);
        inside = inside
            .add(level.set("stroke-width", 1.2).set("stroke-dasharray", "6 3"))
            .add(text((wide - 4.0, y(*value) - 4.0), "s halo", name.clone()).set("text-anchor", "end"));
    }
    for stretch in stretches(time, &plot.values) {
        let points: Vec<String> =
            stretch.iter().map(|(t, value)| format!("{},{}", px(x(*t)), px(y(*value)))).collect();
        let curve = Polyline::new().set("class", "line").set("points", points.join(" "));
        inside = inside.add(curve.set("stroke", plot.colour).set("stroke-width", 1.6));
    }
    let plot = Group::new().set("transform", format!("translate({AXIS} {TOP})"));
    Group::new().add(plot.add(inside).add(outside).add(frame(wide, height)))
}

/// From when to when localisation counted as uncertain.
fn uncertain(reports: &[CycleReport], end: f64) -> Vec<(f64, f64)> {
    let mut spans: Vec<(f64, f64)> = Vec::new();
    for (index, report) in reports.iter().enumerate().filter(|(_, report)| report.scene.uncertain) {
        let (from, to) = (report.scene.stamp, reports.get(index + 1).map_or(end, |next| next.scene.stamp));
        match spans.last_mut() {
            Some((_, until)) if *until >= from => *until = to,
            _ => spans.push((from, to)),
        }
    }
    spans
}

/// The values with their times, cut where a value is not finite.
fn stretches(time: &[f64], values: &[f64]) -> Vec<Vec<(f64, f64)>> {
    let rows: Vec<(f64, f64)> = time.iter().copied().zip(values.iter().copied()).collect();
    rows.split(|(_, value)| !value.is_finite()).filter(|part| !part.is_empty()).map(<[_]>::to_vec).collect()
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

    #[test]
    fn a_value_that_is_none_cuts_the_curve() {
        let parts = stretches(&[0.0, 1.0, 2.0, 3.0], &[1.0, f64::NAN, 2.0, 3.0]);
        assert_eq!(parts, [vec![(0.0, 1.0)], vec![(2.0, 2.0), (3.0, 3.0)]]);
    }
}
