//! One quantity over another, such as time, of one run or of several.

use super::axes::{Scale, frame, label, ticks};
use super::page::{pane, rectangle, translate};
use super::palette::{INK, QUIET, UNCERTAIN};
use super::snapshots::Snapshot;
use super::symbols::{line, text};
use super::viewport::px;
use svg::node::element::{Group, Polyline};

/// Room around a chart for title and numbers, px: left, above, below.
const LEFT: f64 = 34.0;
const TOP: f64 = 22.0;
const BOTTOM: f64 = 24.0;

pub(super) struct Curve<'a> {
    pub(super) colour: &'a str,
    pub(super) width: f64,
    /// (place across, value); values that are not finite are gaps.
    pub(super) points: Vec<(f64, f64)>,
}

pub(super) struct Chart<'a> {
    pub(super) title: &'a str,
    pub(super) scale: Scale,
    /// From where to where across: a time, s, if anything is shaded or numbered.
    pub(super) across: (f64, f64),
    /// Of `across`.
    pub(super) unit: &'a str,
    pub(super) ticks: usize,
    /// From when to when localisation counted as uncertain, s.
    pub(super) uncertain: &'a [(f64, f64)],
    pub(super) snapshots: &'a [Snapshot<'a>],
    /// Levels to compare with, and what they are.
    pub(super) levels: Vec<(f64, String)>,
    /// The first one is on top.
    pub(super) curves: Vec<Curve<'a>>,
}

impl Chart<'_> {
    /// The chart within `size` pixels, title and numbers included.
    pub(super) fn draw(&self, size: (f64, f64)) -> Group {
        let wide = size.0 - LEFT;
        let high = size.1 - TOP - BOTTOM;
        let (from, to) = self.across;
        let x = |t: f64| wide * (t - from) / (to - from).max(1e-6);
        let y = |value: f64| high * (1.0 - self.scale.share(value));
        let mut inside = pane(wide, high);
        for (start, end) in self.uncertain {
            let span = rectangle(x(*end) - x(*start), high, UNCERTAIN).set("x", px(x(*start)));
            inside = inside.add(span.set("fill-opacity", 0.28));
        }
        let mut outside = Group::new().add(text((0.0, -7.0), "b", self.title));
        for value in self.scale.ticks() {
            inside = inside.add(line((0.0, y(value)), (wide, y(value)), "grid"));
            outside = outside.add(text((-6.0, y(value) + 3.5), "s", label(value)).set("text-anchor", "end"));
        }
        for value in ticks(from, to, self.ticks) {
            let number =
                text((x(value), high + 15.0), "s", format!("{} {}", label(value), self.unit).trim_end());
            inside = inside.add(line((x(value), 0.0), (x(value), high), "grid"));
            outside = outside
                .add(line((x(value), high), (x(value), high + 4.0), "tick"))
                .add(number.set("text-anchor", "middle"));
        }
        for snapshot in self.snapshots {
            let at = x(snapshot.report.scene.stamp);
            let mark = line((at, 0.0), (at, high), "line").set("stroke", INK).set("stroke-width", 0.8);
            // Its number beside the line, on the side that is within the chart.
            let beside = if at < wide - 12.0 { at + 3.0 } else { at - 9.0 };
            inside = inside.add(mark.set("stroke-dasharray", "2 3").set("stroke-opacity", 0.7)).add(text(
                (beside, 10.0),
                "s b halo",
                snapshot.number.to_string(),
            ));
        }
        for (value, name) in &self.levels {
            let level = line((0.0, y(*value)), (wide, y(*value)), "line").set("stroke", QUIET);
            inside = inside
                .add(level.set("stroke-width", 1.2).set("stroke-dasharray", "6 3"))
                .add(text((wide - 4.0, y(*value) - 4.0), "s halo", name.clone()).set("text-anchor", "end"));
        }
        for curve in self.curves.iter().rev() {
            for part in curve.points.split(|(_, value)| !value.is_finite()).filter(|part| !part.is_empty()) {
                let points: Vec<String> =
                    part.iter().map(|(t, value)| format!("{},{}", px(x(*t)), px(y(*value)))).collect();
                let drawn = Polyline::new().set("class", "line").set("points", points.join(" "));
                inside = inside.add(drawn.set("stroke", curve.colour).set("stroke-width", curve.width));
            }
        }
        let drawn = Group::new().set("transform", translate(LEFT, TOP));
        Group::new().add(drawn.add(inside).add(outside).add(frame(wide, high)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_value_that_is_none_cuts_the_curve() {
        let points = [1.0, f64::NAN, 2.0, 3.0].into_iter().enumerate();
        let points = points.map(|(t, value)| (t as f64, value)).collect();
        let chart = Chart {
            title: "",
            scale: Scale::linear(0.0, 4.0),
            across: (0.0, 3.0),
            unit: "s",
            ticks: 3,
            uncertain: &[],
            snapshots: &[],
            levels: Vec::new(),
            curves: vec![Curve { colour: INK, width: 1.0, points }],
        };
        // The chart is 300 pixels wide and 100 high.
        let drawn = chart.draw((300.0 + LEFT, 100.0 + TOP + BOTTOM)).to_string();
        let curves: Vec<&str> =
            drawn.split("points=\"").skip(1).filter_map(|part| Some(part.split_once('"')?.0)).collect();
        assert_eq!(curves, ["0,75", "200,50 300,25"]);
    }
}
