//! How often planners succeed, over how crowded it is.

use super::axes::Scale;
use super::chart::{Chart, Curve};
use super::page::printable;
use svg::node::element::SVG;

/// Size of the chart, px.
const SIZE: (f64, f64) = (760.0, 330.0);

/// One planner.
pub struct ShareCurve<'a> {
    /// Its colour, as CSS writes it.
    pub colour: &'a str,
    /// (people per m2, share of the runs from 0 to 1), the densities ascending.
    pub points: Vec<(f64, f64)>,
}

/// Success over density as one `svg` element; its style sheet is [`super::style_sheet`], to be given once. The first
/// planner is drawn strong. Which colour is whose, the text around it says.
pub fn shares_svg(curves: &[ShareCurve<'_>]) -> String {
    let densities = curves.iter().flat_map(|curve| curve.points.iter().map(|point| point.0));
    let drawn = curves.iter().enumerate().map(|(index, curve)| Curve {
        colour: curve.colour,
        width: if index == 0 { 3.0 } else { 1.7 },
        points: curve.points.clone(),
    });
    let chart = Chart {
        title: "Share of runs that reached the goal without collision, over people per m\u{b2}",
        scale: Scale::linear(0.0, 1.04),
        across: (0.0, densities.fold(1e-3, f64::max)),
        unit: "",
        ticks: 10,
        uncertain: &[],
        snapshots: &[],
        levels: vec![(0.5, "half".to_owned())],
        curves: drawn.collect(),
    };
    let document = SVG::new()
        .set("viewBox", format!("0 0 {} {}", SIZE.0 + 12.0, SIZE.1))
        .set("class", "comparison")
        .set("style", format!("max-width:{}px", SIZE.0))
        .add(chart.draw(SIZE));
    printable(&document.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_planner_is_a_curve_from_no_people_to_the_densest() {
        let points = vec![(0.1, 1.0), (0.2, 0.5), (0.4, 0.0)];
        let curve = |colour| ShareCurve { colour, points: points.clone() };
        let svg = shares_svg(&[curve("#111111"), curve("#222222")]);
        assert_eq!(svg.matches("<polyline").count(), 2);
        // 726 px stand for 0.4 people per m2, and the upper edge for 1.04.
        let right = svg.split("points=\"").nth(1).and_then(|part| part.split(' ').next_back());
        assert!(svg.contains("726,284") && right.is_some(), "{svg}");
        assert!(!shares_svg(&[]).contains("NaN"));
    }
}
