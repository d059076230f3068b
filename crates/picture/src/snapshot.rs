//! One planning cycle from close by: what could be done, what it would cost, what was chosen and why.

use super::axes::axes;
use super::map_layer::zones_and_walls;
use super::page::{MAP_ID, Panel, pane, rectangle, translate};
use super::palette::{BELIEF, INK, TRUTH, cost_colour};
use super::run::Run;
use super::snapshots::Snapshot;
use super::symbols::{badge, covariance_ellipse, crowds, goal, path, person, robot, text};
use super::thing::things;
use super::trace_columns::TraceColumns;
use super::viewport::Viewport;
use curionav_planning::numerics::sin_cos;
use curionav_schemas::{Action, CandidateSet, CycleReport, words};
use svg::node::element::{Group, Polygon, Polyline, SVG, TSpan};

/// Half the side of the part of the map that is shown, m.
const REACH_M: f64 = 6.0;
/// Candidates drawn of one cycle: more are a solid area, and a large file.
const MOST_DRAWN: usize = 250;
/// Height of the line above and of the lines below the map, px.
const CAPTION: (f64, f64) = (24.0, 74.0);
/// Room for the numbers left of the map, px.
const AXIS: f64 = 26.0;
/// Height of a line of the captions, px.
const ROW: f64 = 13.0;
/// Pixels a character of the captions takes on average.
const CHARACTER: f64 = 6.2;

pub(super) fn snapshot(run: &Run<'_>, trace: &TraceColumns, shown: &Snapshot<'_>, width: f64) -> Panel {
    let report = shown.report;
    let side = width - AXIS;
    let belief = &report.scene.belief;
    let viewport = Viewport::around((belief.x, belief.y), REACH_M, side);
    let floor = zones_and_walls(run.map, (run.walls(), MAP_ID), &viewport);
    let inside = floor
        .fold(pane(side, side).add(rectangle(side, side, "#fff")), SVG::add)
        .add(things(&viewport, run.things))
        .add(obstacles(report, &viewport))
        .add(crowds(&viewport, &report.crowds))
        .add(goal(&viewport, run.goal, run.goal_tolerance))
        .add(candidates(report, &viewport))
        .add(people(report, &viewport))
        .add(robots(run, trace, shown, &viewport));
    let title = format!("{:.1} s \u{b7} {}", report.scene.stamp, shown.label);
    let map = Group::new()
        .set("transform", translate(AXIS, CAPTION.0))
        .add(inside)
        .add(axes(&viewport, 50.0))
        .add(caption(report, side).set("transform", translate(0.0, side + 30.0)));
    let content = Group::new()
        .set("class", "snapshot")
        .add(badge((AXIS + 8.0, 11.0), shown.number))
        .add(text((AXIS + 22.0, 15.0), "h2", title))
        .add(map);
    Panel { content, width, height: side + CAPTION.0 + CAPTION.1 + 12.0 }
}

/// What the robot has seen and is on no map.
fn obstacles(report: &CycleReport, viewport: &Viewport) -> Group {
    let Some(cells) = &report.obstacles else { return Group::new() };
    let (sin, cos) = sin_cos(cells.heading);
    let centres = cells.x.iter().zip(cells.y.iter()).map(|(x, y)| (f64::from(*x), f64::from(*y)));
    centres.filter(|at| viewport.holds(*at, cells.side)).fold(Group::new(), |group, (x, y)| {
        let half = 0.5 * cells.side;
        let corners = [(-half, -half), (half, -half), (half, half), (-half, half)];
        let turned = corners.map(|(u, v)| (x + cos * u - sin * v, y + sin * u + cos * v));
        group.add(
            Polygon::new().set("class", "obstacle").set("points", viewport.points(turned)).set("fill", INK),
        )
    })
}

/// Rejected candidates first, then from the most to the least expensive, the chosen one on top.
fn candidates(report: &CycleReport, viewport: &Viewport) -> Group {
    let start = (report.scene.belief.x, report.scene.belief.y);
    let (low, high) = cost_range(report);
    let mut group = Group::new();
    for index in drawn(report) {
        let line = Polyline::new().set("points", viewport.points(way(report, index)));
        group = group.add(match report.open_cost(index) {
            None => line.set("class", "rejected"),
            Some(cost) => {
                let share = if high > low { (cost - low) / (high - low) } else { 0.0 };
                line.set("class", "candidate").set("stroke", cost_colour(share))
            }
        });
    }
    let decision = &report.decision;
    let (way, dashes): (Vec<_>, _) = match (report.chosen, decision.action) {
        (_, Action::Stop) => return group,
        (Some(chosen), Action::Follow) => (way(report, chosen as usize).collect(), "none"),
        _ => {
            let decided = decision.x.iter().copied().zip(decision.y.iter().copied());
            (std::iter::once(start).chain(decided).collect(), "7 4")
        }
    };
    let over = path(viewport, way.iter().copied(), INK, 2.8).set("class", "line chosen");
    group.add(path(viewport, way, "#fff", 5.0)).add(over.set("stroke-dasharray", dashes))
}

/// From where the robot believed it was through the states of a candidate.
fn way(report: &CycleReport, index: usize) -> impl Iterator<Item = (f64, f64)> {
    let start = (report.scene.belief.x, report.scene.belief.y);
    std::iter::once(start).chain(states(&report.candidates, index))
}

fn states(candidates: &CandidateSet, index: usize) -> impl Iterator<Item = (f64, f64)> {
    let steps = candidates.steps as usize;
    let range = index * steps..(index + 1) * steps;
    let [x, y] = [&candidates.x, &candidates.y].map(|all| all.get(range.clone()).unwrap_or_default());
    x.iter().copied().zip(y.iter().copied())
}

/// Candidates in the order in which they are drawn; of very many every n-th, by rank in cost.
fn drawn(report: &CycleReport) -> Vec<usize> {
    let mut order: Vec<usize> = (0..report.candidates.count as usize).collect();
    // Those without a cost count as more expensive than any other.
    let costs: Vec<f64> = order.iter().map(|i| report.open_cost(*i).unwrap_or(f64::INFINITY)).collect();
    order.sort_by(|a, b| costs[*b].total_cmp(&costs[*a]));
    let every = order.len().div_ceil(MOST_DRAWN).max(1);
    order.into_iter().rev().step_by(every).collect::<Vec<_>>().into_iter().rev().collect()
}

/// Least and greatest cost of the candidates that were compared; without any the least is above the greatest.
fn cost_range(report: &CycleReport) -> (f64, f64) {
    let none = (f64::INFINITY, f64::NEG_INFINITY);
    report.open_costs().fold(none, |(low, high), cost| (low.min(cost), high.max(cost)))
}

fn people(report: &CycleReport, viewport: &Viewport) -> Group {
    let people = &report.scene.people;
    let places = (0..people.id.len()).map(|i| ((people.x[i], people.y[i]), (people.vx[i], people.vy[i])));
    places
        .filter(|(at, _)| viewport.holds(*at, 2.0))
        .fold(Group::new(), |group, (at, velocity)| group.add(person(viewport, at, velocity, people.radius)))
}

fn robots(run: &Run<'_>, trace: &TraceColumns, shown: &Snapshot<'_>, viewport: &Viewport) -> Group {
    let belief = &shown.report.scene.belief;
    let at = (belief.x, belief.y);
    let covariance = match belief.covariance[..] {
        [xx, xy, _, _, yy, ..] => [xx, xy, yy],
        _ => [0.0; 3],
    };
    let mut group = Group::new().add(covariance_ellipse(viewport, at, covariance));
    if let (Some(truth), Some(heading)) = (trace.truth.get(shown.row), trace.heading.get(shown.row)) {
        group = group.add(robot(viewport, *truth, *heading, run.robot_radius, TRUTH));
    }
    group.add(robot(viewport, at, belief.heading, run.robot_radius, BELIEF).set("stroke-dasharray", "4 2"))
}

/// What was decided, why, by how much, and what was not as it should be.
fn caption(report: &CycleReport, width: f64) -> Group {
    let decision = &report.decision;
    let columns = (width / CHARACTER) as usize;
    let action = match decision.action {
        Action::Follow => "Follow",
        Action::Hold => "Hold",
        Action::Stop => "Stop",
    };
    let mut lines = wrapped(&format!("{action}: {}", words::say("reason", &decision.reason)), columns, 2);
    lines.extend(wrapped(&costs(report), columns, 2));
    let first = lines[0].strip_prefix(action).unwrap_or_default().to_owned();
    let first = text((0.0, 0.0), "", "").add(TSpan::new(action).set("class", "b")).add(TSpan::new(first));
    let mut group = Group::new().add(first);
    for (index, line) in lines.iter().enumerate().skip(1) {
        group = group.add(text((0.0, ROW * index as f64), "", line.as_str()));
    }
    if !decision.degraded.is_empty() {
        let words = format!("Degraded: {}", words::say_all("degradation", &decision.degraded));
        let line = text((0.0, ROW * lines.len() as f64), "b", wrapped(&words, columns, 1).concat());
        group = group.add(line.set("style", format!("fill:{BELIEF}")));
    }
    group
}

/// Numbers of candidates, the range of their costs, and the margin of the chosen one over the next.
fn costs(report: &CycleReport) -> String {
    let count = report.candidates.count as usize;
    let rejected = count - report.open_costs().count();
    let mut words = format!("{count} candidates ({rejected} rejected");
    let left_out = count - drawn(report).len();
    if left_out > 0 {
        words += &format!(", {left_out} not drawn");
    }
    words.push(')');
    let (low, high) = cost_range(report);
    if low <= high {
        words += &format!(", cost {low:.2}\u{2013}{high:.2}");
    }
    if let Some(margin) = report.margin {
        words += &format!(", margin {margin:.3}");
    }
    words + if report.scene.uncertain { ", uncertain" } else { "" }
}

/// The text in lines of at most `columns` characters; what goes beyond `lines` lines ends in an ellipsis.
fn wrapped(content: &str, columns: usize, lines: usize) -> Vec<String> {
    let mut rows = vec![String::new()];
    for word in content.split_whitespace() {
        let row = rows.last_mut().map_or(0, |row| row.chars().count());
        if row > 0 && row + 1 + word.chars().count() > columns {
            rows.push(String::new());
        }
        if let Some(row) = rows.last_mut() {
            if !row.is_empty() {
                row.push(' ');
            }
            row.extend(word.chars().take(columns));
        }
    }
    if rows.len() > lines {
        rows.truncate(lines);
        if let Some(row) = rows.last_mut() {
            *row = row.chars().take(columns.saturating_sub(1)).chain(['\u{2026}']).collect();
        }
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    #[test]
    fn the_chosen_candidate_is_drawn_last_and_the_rejected_first() {
        let mut report = golden::cycle_report();
        assert_eq!(drawn(&report), [0, 1]);
        report.rejected[0].candidate = 1;
        assert_eq!(drawn(&report), [1, 0]);
    }

    #[test]
    fn of_very_many_candidates_the_cheapest_stays() {
        let mut report = golden::cycle_report();
        let count = 1_000;
        report.candidates.count = count;
        report.total = (0..count).map(|i| f64::from((i + 500) % count)).collect();
        report.scored = (0..count).collect();
        report.rejected.clear();
        let shown = drawn(&report);
        assert_eq!(shown.len(), MOST_DRAWN);
        assert_eq!(shown.last(), Some(&500));
    }

    #[test]
    fn long_reasons_are_wrapped_and_cut() {
        assert_eq!(wrapped("one two three", 7, 2), ["one two", "three"]);
        assert_eq!(wrapped("one two three four", 7, 2), ["one two", "three\u{2026}"]);
        assert_eq!(wrapped("", 7, 2), [""]);
    }
}
