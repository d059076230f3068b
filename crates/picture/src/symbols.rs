//! What stands for the robot, people, crowds and uncertainty.

use super::palette::{BELIEF, CROWD, GOAL, INK, PERSON};
use super::viewport::{Viewport, px};
use curionav_planning::numerics::{atan2, eigenvalues, hypot, sin_cos};
use curionav_schemas::Crowd;
use svg::node::element::{Circle, Ellipse, Group, Line, Path, Polygon, Polyline, Text};

/// Seconds of walking an arrow stands for.
const ARROW_S: f64 = 0.8;
/// Below this speed a person stands and has no arrow, m/s.
const STANDING: f64 = 0.05;
/// Most visible crowd; fainter ones in proportion to their weight.
const CROWD_OPACITY: f64 = 0.55;

pub(super) fn text(at: (f64, f64), class: &str, content: impl Into<String>) -> Text {
    Text::new(content).set("class", class).set("x", px(at.0)).set("y", px(at.1))
}

pub(super) fn line(from: (f64, f64), to: (f64, f64), class: &str) -> Line {
    let line = Line::new().set("class", class).set("x1", px(from.0)).set("y1", px(from.1));
    line.set("x2", px(to.0)).set("y2", px(to.1))
}

pub(super) fn path(
    viewport: &Viewport,
    points: impl IntoIterator<Item = (f64, f64)>,
    colour: &str,
    width: f64,
) -> Polyline {
    let line = Polyline::new().set("class", "line").set("points", viewport.points(points));
    line.set("stroke", colour).set("stroke-width", width)
}

/// Where people have walked or are going to walk, each a line through points of the map frame.
pub(super) fn tracks(viewport: &Viewport, lines: impl IntoIterator<Item = Vec<(f64, f64)>>) -> Group {
    lines.into_iter().fold(Group::new(), |group, line| {
        group.add(Polyline::new().set("class", "track").set("points", viewport.points(line)))
    })
}

/// A disc of `radius` metres, but never too small to see.
pub(super) fn disc(viewport: &Viewport, at: (f64, f64), radius: f64) -> Circle {
    let (x, y) = viewport.at(at);
    Circle::new().set("cx", px(x)).set("cy", px(y)).set("r", px((viewport.scale * radius).max(2.0)))
}

fn tinted(disc: Circle, (fill, opacity): (&str, f64), (stroke, width): (&str, f64)) -> Circle {
    let filled = disc.set("fill", fill).set("fill-opacity", opacity);
    filled.set("stroke", stroke).set("stroke-width", width)
}

/// A person with an arrow that reaches as far as they walk in [`ARROW_S`].
pub(super) fn person(viewport: &Viewport, at: (f64, f64), velocity: (f64, f64), radius: f64) -> Group {
    let body = tinted(disc(viewport, at, radius), (PERSON, 0.55), (PERSON, 0.8));
    let group = Group::new().set("class", "person").add(body);
    let speed = hypot(velocity.0, velocity.1);
    if speed < STANDING {
        return group;
    }
    let reach = radius.max(2.0 / viewport.scale) / speed + ARROW_S;
    let tip = viewport.at((at.0 + reach * velocity.0, at.1 + reach * velocity.1));
    group.add(arrow(viewport.at(at), tip, PERSON))
}

fn arrow(from: (f64, f64), tip: (f64, f64), colour: &str) -> Path {
    const HEAD: f64 = 4.0;
    let length = hypot(tip.0 - from.0, tip.1 - from.1).max(1e-9);
    let along = ((tip.0 - from.0) / length, (tip.1 - from.1) / length);
    let pair = |x: f64, y: f64| format!("{} {}", px(x), px(y));
    let barb = |side: f64| {
        let across = side * HEAD * 0.6;
        pair(tip.0 - HEAD * along.0 - across * along.1, tip.1 - HEAD * along.1 + across * along.0)
    };
    let end = pair(tip.0, tip.1);
    let strokes = format!("M{}L{end}M{}L{end}L{}", pair(from.0, from.1), barb(1.0), barb(-1.0));
    Path::new().set("d", strokes).set("fill", "none").set("stroke", colour).set("stroke-width", 1.3)
}

/// The crowds, each as its circle of one standard deviation, the fainter the less it weighs.
pub(super) fn crowds(viewport: &Viewport, crowds: &[Crowd]) -> Group {
    let most = crowds.iter().map(|crowd| crowd.weight).fold(f64::MIN_POSITIVE, f64::max);
    crowds.iter().fold(Group::new(), |group, crowd| {
        let opacity = (CROWD_OPACITY * crowd.weight / most * 100.0).round() / 100.0;
        let width = if crowd.members > 1 { 1.2 } else { 0.6 };
        let circle = disc(viewport, (crowd.x, crowd.y), crowd.sigma.sqrt()).set("class", "crowd");
        group.add(tinted(circle, (CROWD, opacity), (CROWD, width)))
    })
}

/// The ellipse of two standard deviations of a position with covariance `[xx, xy, yy]`.
pub(super) fn covariance_ellipse(viewport: &Viewport, at: (f64, f64), [xx, xy, yy]: [f64; 3]) -> Ellipse {
    let (x, y) = viewport.at(at);
    let (greater, less) = eigenvalues(xx, xy, yy);
    let radius = |variance: f64| px(2.0 * viewport.scale * variance.max(0.0).sqrt());
    let angle = 0.5 * atan2(2.0 * xy, xx - yy);
    let turn = format!("rotate({:.1} {} {})", -angle.to_degrees() + 0.0, px(x), px(y));
    let (major, minor) = (radius(greater), radius(less));
    let ellipse = Ellipse::new().set("cx", px(x)).set("cy", px(y)).set("rx", major).set("ry", minor);
    let filled = ellipse.set("transform", turn).set("fill", BELIEF).set("fill-opacity", 0.1);
    filled.set("stroke", BELIEF).set("stroke-width", 0.8)
}

pub(super) fn robot(viewport: &Viewport, at: (f64, f64), heading: f64, radius: f64, colour: &str) -> Group {
    let (sin, cos) = sin_cos(heading);
    let nose = (at.0 + radius * cos, at.1 + radius * sin);
    let body = tinted(disc(viewport, at, radius), ("#fff", 0.75), (colour, 1.6));
    let heads = line(viewport.at(at), viewport.at(nose), "line").set("stroke", colour);
    Group::new().add(body).add(heads.set("stroke-width", 1.6))
}

/// The goal as a star in the circle in which it counts as reached.
pub(super) fn goal(viewport: &Viewport, at: (f64, f64), tolerance: f64) -> Group {
    let circle = tinted(disc(viewport, at, tolerance), (GOAL, 0.15), (GOAL, 1.2));
    Group::new().add(circle.set("stroke-dasharray", "4 2")).add(star(viewport.at(at)))
}

pub(super) fn star((x, y): (f64, f64)) -> Polygon {
    const POINTS: u32 = 10;
    let corners: Vec<String> = (0..POINTS)
        .map(|i| {
            let radius = if i % 2 == 0 { 7.5 } else { 3.2 };
            let angle = std::f64::consts::PI * (2.0 * f64::from(i) / f64::from(POINTS) - 0.5);
            let (sin, cos) = sin_cos(angle);
            format!("{},{}", px(x + radius * cos), px(y + radius * sin))
        })
        .collect();
    let star = Polygon::new().set("points", corners.join(" ")).set("fill", GOAL);
    star.set("stroke", "#fff").set("stroke-width", 0.8)
}

/// The number of a snapshot in a small disc, in pixels.
pub(super) fn badge((x, y): (f64, f64), number: usize) -> Group {
    let disc = Circle::new().set("cx", px(x)).set("cy", px(y)).set("r", 7.5).set("fill", INK);
    let number = text((x, y + 3.6), "b", number.to_string()).set("text-anchor", "middle");
    Group::new()
        .add(disc.set("stroke", "#fff").set("stroke-width", 1))
        .add(number.set("style", "fill:#fff;font-size:10px"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ellipse_points_along_the_greatest_variance() {
        let viewport = Viewport::around((0.0, 0.0), 5.0, 100.0);
        // Variance 4 along the diagonal, 1 across: [xx, xy, yy] = [2.5, 1.5, 2.5]; 10 px a metre, two sigma.
        let drawn = covariance_ellipse(&viewport, (0.0, 0.0), [2.5, 1.5, 2.5]).to_string();
        assert!(drawn.contains(r#"rx="40""#) && drawn.contains(r#"ry="20""#), "{drawn}");
        // Up on the page is a negative turn.
        assert!(drawn.contains("rotate(-45.0 50 50)"), "{drawn}");
    }

    #[test]
    fn a_person_who_stands_has_no_arrow() {
        let viewport = Viewport::around((0.0, 0.0), 5.0, 100.0);
        assert!(!person(&viewport, (0.0, 0.0), (0.0, 0.0), 0.3).to_string().contains("<path"));
        assert!(person(&viewport, (0.0, 0.0), (1.0, 0.0), 0.3).to_string().contains("<path"));
    }
}
