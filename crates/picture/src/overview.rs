//! The whole run on the map.

use super::axes::{axes, scale_bar};
use super::map_layer::{known, map_layer};
use super::page::{MAP_ID, Panel};
use super::palette::{BELIEF, INK, TRUTH};
use super::run::Run;
use super::snapshots::Snapshot;
use super::symbols::{badge, covariance_ellipse, disc, goal, line, path, person, robot};
use super::trace_columns::{TraceColumns, Track};
use super::viewport::{Bounds, Viewport, px};
use curionav_planning::numerics::{hypot, sin_cos};
use svg::node::element::{Group, Polyline, SVG};

/// Free space around the way driven that is shown of a large map, m.
const MARGIN_M: f64 = 3.0;
/// A map is shown whole while it has at most this many times the area of the part that matters.
const WHOLE_UP_TO: f64 = 3.0;
/// From one uncertainty ellipse to the next, s.
const ELLIPSE_EVERY_S: f64 = 2.0;
/// Room for the numbers left of and below the map, px.
const AXIS: (f64, f64) = (34.0, 22.0);

/// The map with the way of the robot and of the people, at most `width` x `height` pixels.
pub(super) fn overview(run: &Run<'_>, snapshots: &[Snapshot<'_>], width: f64, height: f64) -> Panel {
    let viewport = Viewport::fit(view(run), width - AXIS.0, height - AXIS.1);
    let inside = SVG::new()
        .set("width", px(viewport.width))
        .set("height", px(viewport.height))
        .add(map_layer(run.map, MAP_ID, &viewport))
        .add(people(run, &viewport))
        .add(goal(&viewport, run.goal, run.goal_tolerance))
        .add(ways(run, &viewport))
        .add(badges(run, snapshots, &viewport))
        .add(scale_bar(&viewport));
    let group = Group::new()
        .set("transform", format!("translate({} 0)", AXIS.0))
        .add(axes(&viewport, 70.0))
        .add(inside);
    Panel {
        content: Group::new().add(group),
        width: viewport.width + AXIS.0,
        height: viewport.height + AXIS.1,
    }
}

/// The known part of the map, or what matters of it.
fn view(run: &Run<'_>) -> Bounds {
    let whole = known(run.map);
    if run.trace.truth.is_empty() {
        return whole;
    }
    let way = run.trace.truth.iter().copied().chain([run.goal]);
    let matters = Bounds::of(way).grown(MARGIN_M.max(run.goal_tolerance));
    let area = |bounds: Bounds| bounds.width() * bounds.height();
    if area(whole) <= WHOLE_UP_TO * area(matters) { whole } else { matters.within(whole) }
}

fn people(run: &Run<'_>, viewport: &Viewport) -> Group {
    let tracks = run.trace.people.iter().flat_map(Track::stretches).fold(Group::new(), |group, stretch| {
        group.add(Polyline::new().set("class", "track").set("points", viewport.points(stretch)))
    });
    let ends = run.trace.people.iter().filter_map(|track| track.end(&run.trace.time));
    ends.filter(|(at, _)| viewport.holds(*at, 1.0))
        .fold(tracks, |group, (at, velocity)| group.add(person(viewport, at, velocity, run.person_radius)))
}

/// The true way, the believed one with its uncertainty, start and end.
fn ways(run: &Run<'_>, viewport: &Viewport) -> Group {
    let TraceColumns { time, truth, belief, covariance, heading, .. } = &run.trace;
    let mut group = Group::new();
    let mut due = f64::NEG_INFINITY;
    for ((time, at), covariance) in time.iter().zip(belief).zip(covariance) {
        if *time >= due {
            group = group.add(covariance_ellipse(viewport, *at, *covariance));
            due = time + ELLIPSE_EVERY_S - 1e-6;
        }
    }
    group = group
        .add(path(viewport, truth.iter().copied(), TRUTH, 3.0))
        .add(path(viewport, belief.iter().copied(), BELIEF, 1.6).set("stroke-dasharray", "6 4"));
    if let (Some(start), Some(end)) = (truth.first(), truth.last()) {
        let heading = heading.last().copied().unwrap_or_default();
        group = group
            .add(disc(viewport, *start, run.robot_radius).set("fill", INK).set("stroke", "#fff"))
            .add(robot(viewport, *end, heading, run.robot_radius, TRUTH));
    }
    group
}

/// The numbers of the snapshots beside the way, clear of each other.
fn badges(run: &Run<'_>, snapshots: &[Snapshot<'_>], viewport: &Viewport) -> Group {
    const AWAY: f64 = 20.0;
    const APART: f64 = 17.0;
    let mut taken: Vec<(f64, f64)> = Vec::new();
    let mut group = Group::new();
    for snapshot in snapshots {
        let Some(at) = run.trace.truth.get(snapshot.row) else { continue };
        let heading = run.trace.heading.get(snapshot.row).copied().unwrap_or_default();
        let (x, y) = viewport.at(*at);
        let place = |turn: f64| {
            let angle = -(heading + turn.to_radians());
            let (sin, cos) = sin_cos(angle);
            (x + AWAY * cos, y + AWAY * sin)
        };
        let is_clear = |(x, y): &(f64, f64)| {
            let inside = (9.0..viewport.width - 9.0).contains(x) && (9.0..viewport.height - 9.0).contains(y);
            inside && taken.iter().all(|(u, v)| hypot(x - u, y - v) >= APART)
        };
        let turns = [90.0, -90.0, 135.0, -135.0, 45.0, -45.0, 180.0, 0.0];
        let spot = turns.map(place).into_iter().find(is_clear).unwrap_or_else(|| place(90.0));
        taken.push(spot);
        group = group
            .add(line((x, y), spot, "line").set("stroke", INK).set("stroke-width", 0.9))
            .add(badge(spot, snapshot.number));
    }
    group
}
