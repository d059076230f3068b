//! A run on one page: the map with the tracks of robot and people, a few planning cycles enlarged, and plots over time.

use super::page::{Column, GAP, MAP_HEIGHT, MAP_ID, Panel, RIM, WIDTH, printable};
use super::run::Run;
use super::snapshots::snapshots;
use super::trace_columns::TraceColumns;
use super::viewport::px;
use super::{heading, legend, map_layer, overview, palette, plots, snapshot};
use curionav_schemas::{CycleReport, OccupancyGrid, RunResult};
use svg::node::element::{Definitions, Rectangle, SVG, Style, Title};

/// Snapshots beside each other.
const COLUMNS: usize = 3;
/// A person's radius when no report tells it, m.
const PERSON_RADIUS_M: f64 = 0.3;

/// The picture of a run; `goal`, `robot_radius` and `goal_tolerance` in metres, in the map frame. Without reports the
/// cycles are left out, without a trace the tracks.
pub fn run_svg(
    result: &RunResult,
    reports: &[CycleReport],
    map: &OccupancyGrid,
    goal: (f64, f64),
    robot_radius: f64,
    goal_tolerance: f64,
) -> String {
    let person_radius = reports.first().map_or(PERSON_RADIUS_M, |report| report.scene.people.radius);
    let trace = TraceColumns::new(&result.trace);
    page(&Run { result, reports, map, trace, goal, robot_radius, goal_tolerance, person_radius })
}

/// The parts below each other.
fn page(run: &Run<'_>) -> String {
    let wide = WIDTH - 2.0 * RIM;
    let shown = snapshots(run.reports, &run.trace);
    let mut column = Column { parts: Vec::new(), bottom: RIM };
    column.add(RIM, heading::heading(run, wide));

    let map = overview::overview(run, &shown, wide, MAP_HEIGHT);
    let beside = wide - map.width - 2.0 * GAP;
    let legend = legend::legend(if beside >= 280.0 { beside } else { wide });
    if beside >= legend.width {
        let left = RIM + map.width + 2.0 * GAP;
        column.add_beside(left, legend);
        column.add(RIM, map);
    } else {
        let left = RIM + (wide - map.width) / 2.0;
        column.add(left, map);
        column.add(RIM + 20.0, legend);
    }

    let each = (wide - GAP * (COLUMNS - 1) as f64) / COLUMNS as f64;
    for row in shown.chunks(COLUMNS) {
        let panels: Vec<Panel> = row.iter().map(|one| snapshot::snapshot(run, one, each)).collect();
        column.add_row(RIM, GAP, panels);
    }
    column.add(RIM, plots::plots(run, &shown, wide));
    finished(run, column)
}

fn finished(run: &Run<'_>, column: Column) -> String {
    let height = px(column.bottom - GAP + RIM);
    let title = format!("{}, planner {}, seed {}", run.result.scenario, run.result.planner, run.result.seed);
    let document = SVG::new()
        .set("width", WIDTH)
        .set("height", height)
        .set("viewBox", format!("0 0 {WIDTH} {height}"))
        .add(Title::new(title))
        .add(Style::new(palette::style_sheet()))
        .add(Definitions::new().add(map_layer::definition(run.map, MAP_ID)))
        .add(Rectangle::new().set("width", WIDTH).set("height", height).set("fill", "#fff"));
    let document = column.parts.into_iter().fold(document, SVG::add);
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", printable(&document.to_string()))
}

#[cfg(test)]
#[path = "run_page_tests.rs"]
mod tests;
