//! A run on one page: the map with the tracks of robot and people, a few planning cycles enlarged, and plots over time.

use super::page::{Column, GAP, MAP_HEIGHT, MAP_ID, Panel, RIM, WIDTH, document, file};
use super::run::Run;
use super::snapshots::snapshots;
use super::trace_columns::TraceColumns;
use super::{heading, legend, map_layer, overview, plots, snapshot};
use svg::node::element::{Definitions, SVG};

const COLUMNS: usize = 3;

/// The picture of a run: its parts below each other.
pub fn run_svg(run: &Run<'_>) -> String {
    let wide = WIDTH - 2.0 * RIM;
    let trace = &TraceColumns::new(&run.result.trace);
    let shown = snapshots(run.reports, trace);
    let mut column = Column { parts: Vec::new(), bottom: RIM };
    column.add(RIM, heading::heading(run.result, wide));

    let map = overview::overview(run, trace, &shown, wide, MAP_HEIGHT);
    let beside = wide - map.width - 2.0 * GAP;
    let legend = legend::legend(if beside >= 280.0 { beside } else { wide }, run);
    if beside >= legend.width {
        column.add_beside(RIM + map.width + 2.0 * GAP, legend);
        column.add(RIM, map);
    } else {
        column.add(RIM + (wide - map.width) / 2.0, map);
        column.add(RIM + 20.0, legend);
    }

    let each = (wide - GAP * (COLUMNS - 1) as f64) / COLUMNS as f64;
    for row in shown.chunks(COLUMNS) {
        let panels: Vec<Panel> = row.iter().map(|one| snapshot::snapshot(run, trace, one, each)).collect();
        column.add_row(RIM, GAP, panels);
    }
    column.add(RIM, plots::plots(run, trace, &shown, wide));

    let title = format!("{}, planner {}, seed {}", run.result.scenario, run.result.planner, run.result.seed);
    let walls = map_layer::definition(run.walls(), MAP_ID);
    let zones = map_layer::zones(run.map);
    let map = zones.into_iter().fold(Definitions::new().add(walls), Definitions::add);
    let empty = document(&title, (WIDTH, column.bottom - GAP + RIM), map);
    file(&column.parts.into_iter().fold(empty, SVG::add))
}

#[cfg(test)]
#[path = "run_page_tests.rs"]
mod tests;
