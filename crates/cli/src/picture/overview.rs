//! The whole run on the map.

use super::axes::{axes, scale_bar};
use super::floor::{floor, known};
use super::journey::{Journey, Track};
use super::moments::Moment;
use super::palette::{BELIEF, INK, TRUTH};
use super::symbols::{badge, covariance_ellipse, disc, goal, path, person, robot};
use super::window::{Bounds, Window, px};
use super::{Panel, Run};
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
pub(super) fn overview(run: &Run<'_>, moments: &[Moment<'_>], width: f64, height: f64) -> Panel {
    let window = Window::fit(view(run), width - AXIS.0, height - AXIS.1);
    let inside = SVG::new()
        .set("width", px(window.width))
        .set("height", px(window.height))
        .add(floor(run.map, super::FLOOR, &window))
        .add(people(run, &window))
        .add(goal(&window, run.goal, run.goal_tolerance))
        .add(ways(run, &window))
        .add(badges(run, moments, &window))
        .add(scale_bar(&window));
    let group = Group::new()
        .set("transform", format!("translate({} 0)", AXIS.0))
        .add(axes(&window, 70.0))
        .add(inside);
    Panel { content: Group::new().add(group), width: window.width + AXIS.0, height: window.height + AXIS.1 }
}

/// The known part of the map, or what matters of it.
fn view(run: &Run<'_>) -> Bounds {
    let whole = known(run.map);
    if run.journey.truth.is_empty() {
        return whole;
    }
    let way = run.journey.truth.iter().copied().chain([run.goal]);
    let matters = Bounds::of(way).grown(MARGIN_M.max(run.goal_tolerance));
    let area = |bounds: Bounds| bounds.width() * bounds.height();
    if area(whole) <= WHOLE_UP_TO * area(matters) { whole } else { matters.within(whole) }
}

fn people(run: &Run<'_>, window: &Window) -> Group {
    let tracks = run.journey.people.iter().flat_map(Track::stretches).fold(Group::new(), |group, stretch| {
        group.add(Polyline::new().set("class", "track").set("points", window.points(stretch)))
    });
    let ends = run.journey.people.iter().filter_map(|track| track.end(&run.journey.time));
    ends.filter(|(at, _)| window.holds(*at, 1.0))
        .fold(tracks, |group, (at, velocity)| group.add(person(window, at, velocity, run.person_radius)))
}

/// The true way, the believed one with its uncertainty, start and end.
fn ways(run: &Run<'_>, window: &Window) -> Group {
    let Journey { time, truth, belief, covariance, heading, .. } = &run.journey;
    let mut group = Group::new();
    let mut due = f64::NEG_INFINITY;
    for ((time, at), covariance) in time.iter().zip(belief).zip(covariance) {
        if *time >= due {
            group = group.add(covariance_ellipse(window, *at, *covariance));
            due = time + ELLIPSE_EVERY_S - 1e-6;
        }
    }
    group = group
        .add(path(window, truth.iter().copied(), TRUTH, 3.0))
        .add(path(window, belief.iter().copied(), BELIEF, 1.6).set("stroke-dasharray", "6 4"));
    if let (Some(start), Some(end)) = (truth.first(), truth.last()) {
        let heading = heading.last().copied().unwrap_or_default();
        group = group
            .add(disc(window, *start, run.robot_radius).set("fill", INK).set("stroke", "#fff"))
            .add(robot(window, *end, heading, run.robot_radius, TRUTH));
    }
    group
}

/// The numbers of the moments beside the way, clear of each other.
fn badges(run: &Run<'_>, moments: &[Moment<'_>], window: &Window) -> Group {
    const AWAY: f64 = 20.0;
    const APART: f64 = 17.0;
    let mut taken: Vec<(f64, f64)> = Vec::new();
    let mut group = Group::new();
    for moment in moments {
        let Some(at) = run.journey.truth.get(moment.row) else { continue };
        let heading = run.journey.heading.get(moment.row).copied().unwrap_or_default();
        let (x, y) = window.at(*at);
        let place = |turn: f64| {
            let angle = -(heading + turn.to_radians());
            (x + AWAY * angle.cos(), y + AWAY * angle.sin())
        };
        let is_clear = |(x, y): &(f64, f64)| {
            let inside = (9.0..window.width - 9.0).contains(x) && (9.0..window.height - 9.0).contains(y);
            inside && taken.iter().all(|(u, v)| (x - u).hypot(y - v) >= APART)
        };
        let turns = [90.0, -90.0, 135.0, -135.0, 45.0, -45.0, 180.0, 0.0];
        let spot = turns.map(place).into_iter().find(is_clear).unwrap_or_else(|| place(90.0));
        taken.push(spot);
        group = group
            .add(super::symbols::line((x, y), spot, "line").set("stroke", INK).set("stroke-width", 0.9))
            .add(badge(spot, moment.number));
    }
    group
}
