//! The whole run on the map.

use super::axes::{AXIS, on_axes, scale_bar};
use super::map_layer::{known, zones_and_walls};
use super::page::{MAP_ID, Panel, pane};
use super::palette::{BELIEF, INK, TRUTH};
use super::run::Run;
use super::snapshots::Snapshot;
use super::symbols::{badge, covariance_ellipse, disc, goal, line, path, person, robot, tracks};
use super::thing::things;
use super::trace_columns::{TraceColumns, Track};
use super::viewport::{Bounds, Viewport};
use curionav_planning::numerics::{hypot, sin_cos};
use svg::node::element::{Group, SVG};

/// Free space around the way driven that is shown of a large map, m.
const MARGIN_M: f64 = 3.0;
/// A map is shown whole while it has at most this many times the area of the part that matters.
const WHOLE_UP_TO: f64 = 3.0;
/// A person's radius when no report tells it, m.
const PERSON_RADIUS_M: f64 = 0.3;
/// From one uncertainty ellipse to the next, s.
const ELLIPSE_EVERY_S: f64 = 2.0;

/// The map with the way of the robot and of the people, at most `width` x `height` pixels.
pub(super) fn overview(
    run: &Run<'_>,
    trace: &TraceColumns,
    snapshots: &[Snapshot<'_>],
    width: f64,
    height: f64,
) -> Panel {
    let mut shown = known(run.walls());
    if !trace.truth.is_empty() {
        let way = trace.truth.iter().copied().chain([run.goal]);
        shown = shown.part(Bounds::of(way).grown(MARGIN_M.max(run.goal_tolerance)), WHOLE_UP_TO);
    }
    let viewport = Viewport::fit(shown, width - AXIS.0, height - AXIS.1);
    let floor = zones_and_walls(run.map, (run.walls(), MAP_ID), &viewport);
    let inside = floor
        .fold(pane(viewport.width, viewport.height), SVG::add)
        .add(things(&viewport, run.things))
        .add(people(run, trace, &viewport))
        .add(goal(&viewport, run.goal, run.goal_tolerance))
        .add(ways(run, trace, &viewport))
        .add(badges(trace, snapshots, &viewport))
        .add(scale_bar(&viewport));
    Panel {
        content: Group::new().add(on_axes(&viewport, inside, (0.0, 0.0))),
        width: viewport.width + AXIS.0,
        height: viewport.height + AXIS.1,
    }
}

fn people(run: &Run<'_>, trace: &TraceColumns, viewport: &Viewport) -> Group {
    let radius = run.reports.first().map_or(PERSON_RADIUS_M, |report| report.scene.people.radius);
    let ends = trace.people.iter().filter_map(|track| track.end(&trace.time));
    ends.filter(|(at, _)| viewport.holds(*at, 1.0))
        .fold(tracks(viewport, trace.people.iter().flat_map(Track::stretches)), |group, (at, velocity)| {
            group.add(person(viewport, at, velocity, radius))
        })
}

/// The true way, the believed one with its uncertainty, start and end.
fn ways(run: &Run<'_>, trace: &TraceColumns, viewport: &Viewport) -> Group {
    let TraceColumns { time, truth, belief, covariance, heading, .. } = trace;
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
fn badges(trace: &TraceColumns, snapshots: &[Snapshot<'_>], viewport: &Viewport) -> Group {
    const AWAY: f64 = 20.0;
    const APART: f64 = 17.0;
    let mut taken: Vec<(f64, f64)> = Vec::new();
    let mut group = Group::new();
    for snapshot in snapshots {
        let Some(at) = trace.truth.get(snapshot.row) else { continue };
        let heading = trace.heading.get(snapshot.row).copied().unwrap_or_default();
        let (x, y) = viewport.at(*at);
        let spots = [90.0_f64, -90.0, 135.0, -135.0, 45.0, -45.0, 180.0, 0.0].map(|turn| {
            let (sin, cos) = sin_cos(-(heading + turn.to_radians()));
            (x + AWAY * cos, y + AWAY * sin)
        });
        let clear = spots.iter().find(|(x, y)| {
            let inside = (9.0..viewport.width - 9.0).contains(x) && (9.0..viewport.height - 9.0).contains(y);
            inside && taken.iter().all(|(u, v)| hypot(x - u, y - v) >= APART)
        });
        let spot = *clear.unwrap_or(&spots[0]);
        taken.push(spot);
        group = group
            .add(line((x, y), spot, "line").set("stroke", INK).set("stroke-width", 0.9))
            .add(badge(spot, snapshot.number));
    }
    group
}
