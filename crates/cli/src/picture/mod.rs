//! A run on one page: the map with the ways driven and walked, a few planning cycles from close by, and plots over
//! time, as one SVG file that needs nothing else and prints sharply.

mod axes;
mod comparison;
mod curves;
mod floor;
mod heading;
mod journey;
mod legend;
mod moment;
mod moments;
mod overview;
mod palette;
mod plots;
mod scene;
mod symbols;
mod window;

pub(crate) use comparison::{Course, Site, comparison_svg};
pub(crate) use palette::{planner_colour, style_sheet};
pub(crate) use scene::scene_svg;

use curionav_schemas::{CycleReport, OccupancyGrid, RunResult};
use journey::Journey;
use svg::node::element::{Definitions, Group, Rectangle, SVG, Style, Title};
use window::px;

/// Width of the page, px.
const WIDTH: f64 = 1200.0;
/// Free rim of the page, px.
const RIM: f64 = 26.0;
/// Greatest height of the map, px.
const MAP_HEIGHT: f64 = 780.0;
/// From one part of the page to the next, px.
const GAP: f64 = 22.0;
/// Moments beside each other.
const COLUMNS: usize = 3;
/// The map's name in the document.
const FLOOR: &str = "floor";
/// A person's radius when no report tells it, m.
const PERSON_RADIUS_M: f64 = 0.3;

/// All there is to draw.
struct Run<'a> {
    result: &'a RunResult,
    reports: &'a [CycleReport],
    map: &'a OccupancyGrid,
    journey: Journey,
    goal: (f64, f64),
    robot_radius: f64,
    goal_tolerance: f64,
    person_radius: f64,
}

/// A part of the page, drawn from its own origin.
struct Panel {
    content: Group,
    width: f64,
    height: f64,
}

/// The picture of a run; `goal`, `robot_radius` and `goal_tolerance` in metres, in the map frame. Without reports the
/// cycles are left out, without a trace the ways.
pub(crate) fn run_svg(
    result: &RunResult,
    reports: &[CycleReport],
    map: &OccupancyGrid,
    goal: (f64, f64),
    robot_radius: f64,
    goal_tolerance: f64,
) -> String {
    let person_radius = reports.first().map_or(PERSON_RADIUS_M, |report| report.scene.people.radius);
    let journey = Journey::new(&result.trace);
    page(&Run { result, reports, map, journey, goal, robot_radius, goal_tolerance, person_radius })
}

/// The parts below each other.
fn page(run: &Run<'_>) -> String {
    let wide = WIDTH - 2.0 * RIM;
    let moments = moments::moments(run.reports, &run.journey);
    let mut column = Column { parts: Vec::new(), bottom: RIM };
    column.add(RIM, heading::heading(run, wide));

    let map = overview::overview(run, &moments, wide, MAP_HEIGHT);
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
    for row in moments.chunks(COLUMNS) {
        let panels: Vec<Panel> = row.iter().map(|moment| moment::moment(run, moment, each)).collect();
        column.add_row(RIM, GAP, panels);
    }
    column.add(RIM, plots::plots(run, &moments, wide));
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
        .add(Definitions::new().add(floor::definition(run.map, FLOOR)))
        .add(Rectangle::new().set("width", WIDTH).set("height", height).set("fill", "#fff"));
    let document = column.parts.into_iter().fold(document, SVG::add);
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", printable(&document.to_string()))
}

/// The text without the characters that XML does not allow, which a name or a reason might hold.
fn printable(text: &str) -> String {
    text.chars().filter(|c| matches!(c, '\t' | '\n' | '\r' | ' '..='\u{fffd}' | '\u{10000}'..)).collect()
}

/// Panels below each other.
struct Column {
    parts: Vec<Group>,
    bottom: f64,
}

impl Column {
    fn place(&mut self, left: f64, panel: Panel) {
        let at = format!("translate({} {})", px(left), px(self.bottom));
        self.parts.push(Group::new().set("transform", at).add(panel.content));
    }

    fn add(&mut self, left: f64, panel: Panel) {
        let height = panel.height;
        self.place(left, panel);
        self.bottom += height + GAP;
    }

    /// A panel beside the one that is added next.
    fn add_beside(&mut self, left: f64, panel: Panel) {
        self.place(left, panel);
    }

    /// Panels beside each other.
    fn add_row(&mut self, left: f64, gap: f64, panels: Vec<Panel>) {
        let height = panels.iter().map(|panel| panel.height).fold(0.0, f64::max);
        let mut x = left;
        for panel in panels {
            let width = panel.width;
            self.place(x, panel);
            x += width + gap;
        }
        self.bottom += height;
    }
}

#[cfg(test)]
mod tests;
