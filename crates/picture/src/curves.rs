//! One quantity of several runs over time.

use super::axes::{Scale, frame, label, ticks};
use super::palette::QUIET;
use super::symbols::{line, text};
use super::viewport::px;
use svg::node::element::{Group, Polyline, SVG};

/// Room around a plot for title and numbers, px: left, above, below.
const AXIS: f64 = 36.0;
const TOP: f64 = 22.0;
const BOTTOM: f64 = 24.0;

/// One run's curve.
pub(super) struct Curve<'a> {
    pub(super) colour: &'a str,
    pub(super) width: f64,
    /// (s, value).
    pub(super) points: Vec<(f64, f64)>,
}

/// The curves within `size` pixels, over 0 to `end` seconds; `levels` are values to compare with.
pub(super) fn curves(
    title: &str,
    scale: Scale,
    end: f64,
    curves: &[Curve<'_>],
    levels: &[(f64, &str)],
    size: (f64, f64),
) -> Group {
    let (wide, high) = (size.0 - AXIS, size.1 - TOP - BOTTOM);
    let x = |t: f64| wide * t / end.max(1e-6);
    let y = |value: f64| high * (1.0 - scale.share(value));
    let mut inside = SVG::new().set("width", px(wide)).set("height", px(high));
    let mut outside = Group::new().add(text((0.0, -7.0), "b", title));
    for value in scale.ticks() {
        inside = inside.add(line((0.0, y(value)), (wide, y(value)), "grid"));
        outside = outside.add(text((-6.0, y(value) + 3.5), "s", label(value)).set("text-anchor", "end"));
    }
    for value in ticks(0.0, end, 8) {
        inside = inside.add(line((x(value), 0.0), (x(value), high), "grid"));
        outside = outside.add(line((x(value), high), (x(value), high + 4.0), "tick")).add(
            text((x(value), high + 15.0), "s", format!("{} s", label(value))).set("text-anchor", "middle"),
        );
    }
    for (value, name) in levels {
        let level = line((0.0, y(*value)), (wide, y(*value)), "line").set("stroke", QUIET);
        inside = inside
            .add(level.set("stroke-width", 1.2).set("stroke-dasharray", "6 3"))
            .add(text((wide - 4.0, y(*value) - 4.0), "s halo", *name).set("text-anchor", "end"));
    }
    for curve in curves.iter().rev() {
        let points: Vec<String> = (curve.points.iter())
            .filter(|(_, value)| value.is_finite())
            .map(|(t, value)| format!("{},{}", px(x(*t)), px(y(*value))))
            .collect();
        inside = inside.add(
            Polyline::new()
                .set("class", "line")
                .set("points", points.join(" "))
                .set("stroke", curve.colour)
                .set("stroke-width", curve.width),
        );
    }
    let at = format!("translate({AXIS} {TOP})");
    Group::new().add(Group::new().set("transform", at).add(inside).add(outside).add(frame(wide, high)))
}
