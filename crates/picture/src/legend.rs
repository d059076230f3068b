//! What the lines, colours and symbols mean.

use super::page::{Panel, rectangle, translate};
use super::palette::{BELIEF, CROWD, GOAL, INK, KEEPOUT, PERSON, SLOW, THING, TRUTH, cost_colour};
use super::run::Run;
use super::symbols::{badge, line, person, star, text};
use super::viewport::{Viewport, px};
use svg::node::element::{Circle, Ellipse, Group, Line};

/// Width of a column and height of a row, px.
const CELL: (f64, f64) = (280.0, 21.0);
const SYMBOL: f64 = 34.0;
/// The middle of a symbol, px.
const MIDDLE: (f64, f64) = (SYMBOL / 2.0, 10.0);

/// The legend in as many columns as fit into `width` pixels.
pub(super) fn legend(width: f64, run: &Run<'_>) -> Panel {
    let columns = ((width / CELL.0) as usize).max(1);
    let entries = entries(run);
    let rows = entries.len().div_ceil(columns);
    let mut content = Group::new();
    for (index, (symbol, words)) in entries.into_iter().enumerate() {
        let x = (index / rows) as f64 * CELL.0;
        let y = (index % rows) as f64 * CELL.1;
        let entry = Group::new().set("transform", translate(x, y)).add(symbol).add(text(
            (SYMBOL + 8.0, 14.0),
            "",
            words,
        ));
        content = content.add(entry);
    }
    Panel { content, width: columns as f64 * CELL.0, height: rows as f64 * CELL.1 }
}

fn entries(run: &Run<'_>) -> Vec<(Group, &'static str)> {
    let ellipse = Ellipse::new().set("cx", MIDDLE.0).set("cy", MIDDLE.1).set("rx", 14).set("ry", 7);
    let ellipse = ellipse.set("fill", BELIEF).set("fill-opacity", 0.1).set("stroke", BELIEF);
    let goal = circle(9.5, GOAL).set("fill-opacity", 0.15).set("stroke", GOAL).set("stroke-dasharray", "4 2");
    let crowd = circle(9.0, CROWD).set("fill-opacity", 0.5).set("stroke", CROWD);
    let thing = rectangle(20.0, 10.0, THING).set("x", 7).set("y", 5).set("stroke", INK);
    // A viewport in which a pixel is a tenth of a metre, to show a person who walks at 1 m/s.
    let viewport = Viewport { min_x: 0.0, max_y: 2.0, width: 34.0, height: 20.0, scale: 10.0 };
    let mut entries = vec![
        (Group::new().add(stroke(TRUTH, 3.0)), "where the robot was"),
        (Group::new().add(stroke(BELIEF, 1.6).set("stroke-dasharray", "6 4")), "where it believed it was"),
        (Group::new().add(ellipse), "uncertainty of the belief, 2 \u{3c3}"),
        (Group::new().add(circle(6.0, INK)), "start"),
        (Group::new().add(goal).add(star(MIDDLE)), "goal, and where it counts as reached"),
        (person(&viewport, (0.9, 1.0), (1.0, 0.0), 0.3), "person, and 0.8 s of their way"),
        (
            Group::new().add(stroke(PERSON, 1.1).set("stroke-opacity", 0.35)),
            "ways of the people (discs: at the end)",
        ),
        (Group::new().add(crowd), "crowd density, 1 \u{3c3}, by weight"),
        (costs(), "candidates, cheap to expensive"),
        (Group::new().add(bar().set("class", "rejected")), "rejected candidates"),
        (Group::new().add(stroke(INK, 2.8)), "chosen (dashed: held)"),
        (badge(MIDDLE, 1), "planning cycle that is shown enlarged"),
    ];
    if !run.things.is_empty() {
        entries.push((Group::new().add(thing), "thing on no map (dashed: it moves)"));
    }
    if run.map.limits.is_some() {
        let zone =
            |x: f64, fill: &str| rectangle(13.0, 10.0, fill).set("x", x).set("y", 5).set("stroke", INK);
        let zones = Group::new().add(zone(3.0, KEEPOUT)).add(zone(18.0, SLOW));
        entries.push((zones, "keepout, and slow floor"));
    }
    entries
}

fn bar() -> Line {
    line((0.0, 10.0), (SYMBOL, 10.0), "line")
}

fn stroke(colour: &str, width: f64) -> Line {
    bar().set("stroke", colour).set("stroke-width", width)
}

fn circle(radius: f64, colour: &str) -> Circle {
    Circle::new().set("cx", MIDDLE.0).set("cy", MIDDLE.1).set("r", radius).set("fill", colour)
}

fn costs() -> Group {
    const SHADES: u32 = 17;
    let width = SYMBOL / f64::from(SHADES);
    (0..SHADES).fold(Group::new().set("shape-rendering", "crispEdges"), |group, i| {
        let shade = rectangle(width, 10.0, &cost_colour(f64::from(i) / f64::from(SHADES - 1)));
        group.add(shade.set("x", px(width * f64::from(i))).set("y", 5))
    })
}
