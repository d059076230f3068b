//! Several planners in one scenario: their ways over the map as the paper's Fig. 4, uncertainty and speed over time
//! as its Fig. 5.

use super::axes::{AXIS, Scale, on_axes, scale_bar};
use super::chart::{Chart, Curve};
use super::map_layer::{area, definition, known, map_layer};
use super::page::{MAP_HEIGHT, RIM, WIDTH, pane, printable, translate};
use super::palette::{BARE, INK, PERSON};
use super::symbols::{disc, goal, line, path, text, tracks, triangle};
use super::trace_columns::{TraceColumns, Track};
use super::viewport::{Bounds, Viewport, px};
use curionav_schemas::{OccupancyGrid, RunResult};
use svg::node::element::{Definitions, Group, SVG};

/// Width of the map's part of the page, px.
const MAP_WIDTH: f64 = 650.0;
const GAP: f64 = 26.0;
/// Height of an entry of the legend, px.
const ENTRY: f64 = 20.0;
/// Four lines of small print, px.
const FOOT: f64 = 64.0;
/// Free space around what is shown of a large map, m.
const MARGIN_M: f64 = 3.0;
/// A map is shown whole while it has at most this many times the area of the part that matters.
const WHOLE_UP_TO: f64 = 4.0;
/// Smallest uncertainty told apart on a logarithmic axis, m2 + rad2.
const LEAST_UNCERTAINTY: f64 = 1e-4;

/// Where the planners were compared.
pub struct Site<'a> {
    /// Unique within the document the picture goes into.
    pub id: &'a str,
    /// The map.
    pub map: &'a OccupancyGrid,
    /// For each cell of `map`, in its order: whether it is free and no landmark is within the laser's range. The
    /// paper's Fig. 4 has this part of the floor grey.
    pub bare: &'a [bool],
    /// Where every run starts, m.
    pub start: (f64, f64),
    /// Where every run is to end, m.
    pub goal: (f64, f64),
    /// Distance at which the goal counts as reached, m.
    pub goal_tolerance: f64,
    /// Radius of the robot's body, m.
    pub robot_radius: f64,
    /// Radius of a person, m.
    pub person_radius: f64,
    /// `Thr'`, m2 + rad2.
    pub threshold: f64,
}

/// What one planner did.
pub struct Course<'a> {
    /// The planner's name.
    pub name: &'a str,
    /// Colour of its tracks and curves, as CSS writes it.
    pub colour: &'a str,
    /// `[run]` where the robot was, m.
    pub ways: Vec<Vec<(f64, f64)>>,
    /// The run that is drawn strong and over time, if its trace is there.
    pub shown: Option<&'a RunResult>,
}

/// Map, plots and legend as one `svg` element; its style sheet is [`super::style_sheet`], to be given once.
pub fn comparison_svg(site: &Site<'_>, courses: &[Course<'_>]) -> String {
    let traces: Vec<Option<TraceColumns>> =
        courses.iter().map(|course| course.shown.map(|run| TraceColumns::new(&run.trace))).collect();
    let all = courses.iter().flat_map(|course| course.ways.iter().flatten().copied());
    let matters = Bounds::of(all.chain([site.start, site.goal])).grown(MARGIN_M);
    let shown = known(site.map).part(matters, WHOLE_UP_TO);
    let viewport = Viewport::fit(shown, MAP_WIDTH - AXIS.0, MAP_HEIGHT - AXIS.1);
    let map = on_axes(&viewport, ways(site, courses, &traces, &viewport), (0.0, 0.0));
    let left = AXIS.0 + viewport.width + GAP;
    let wide = WIDTH - 2.0 * RIM - left;
    let legend_height = ENTRY * courses.len().div_ceil(2) as f64 + ENTRY + FOOT;
    let height = viewport.height.max(legend_height + 300.0);
    let each = (height + AXIS.1 - legend_height) / 2.0;
    let plots = over_time(site, courses, &traces, (wide, each))
        .add(legend(courses, wide).set("transform", translate(36.0, 2.0 * each + 8.0)))
        .set("transform", translate(left, 0.0));
    let (width, height) = (WIDTH - 2.0 * RIM, height + AXIS.1 + 6.0);
    let bare = area(site.map, site.bare, &bare_id(site), BARE);
    let document = SVG::new()
        .set("viewBox", format!("-1 -4 {} {}", px(width + 2.0), px(height)))
        .set("class", "comparison")
        .add(Definitions::new().add(bare).add(definition(site.map, site.id)))
        .add(map)
        .add(plots);
    printable(&document.to_string())
}

fn ways(
    site: &Site<'_>,
    courses: &[Course<'_>],
    traces: &[Option<TraceColumns>],
    viewport: &Viewport,
) -> SVG {
    let mut inside = pane(viewport.width, viewport.height)
        .add(map_layer(site.map, &bare_id(site), viewport))
        .add(map_layer(site.map, site.id, viewport))
        .add(people(site, traces, viewport))
        .add(goal(viewport, site.goal, site.goal_tolerance))
        .add(disc(viewport, site.start, site.robot_radius).set("fill", INK).set("stroke", "#fff"));
    // The first planner is drawn last, on top.
    for course in courses.iter().rev() {
        for way in &course.ways {
            let faint = path(viewport, way.iter().copied(), course.colour, 1.1);
            inside = inside.add(faint.set("stroke-opacity", 0.4));
        }
    }
    for (course, trace) in courses.iter().zip(traces).rev() {
        if let Some(trace) = trace {
            let halo = path(viewport, trace.truth.iter().copied(), "#fff", 4.6).set("stroke-opacity", 0.75);
            inside = inside.add(halo).add(path(viewport, trace.truth.iter().copied(), course.colour, 2.8));
        }
    }
    inside.add(scale_bar(viewport))
}

/// Name of the part of the floor without landmarks in the document.
fn bare_id(site: &Site<'_>) -> String {
    format!("{}-bare", site.id)
}

/// The people's ways during the run of the first planner that is shown, and triangles that point where they walk: white
/// at the start, filled at the end.
fn people(site: &Site<'_>, traces: &[Option<TraceColumns>], viewport: &Viewport) -> Group {
    let Some(first) = traces.iter().flatten().next() else { return Group::new() };
    let shown = tracks(viewport, first.people.iter().flat_map(Track::stretches));
    first.people.iter().fold(shown, |group, track| {
        let ends = [(track.start(&first.time), "#fff"), (track.end(&first.time), PERSON)];
        ends.into_iter().filter_map(|(end, fill)| Some((end?, fill))).fold(group, |group, (end, fill)| {
            let (at, velocity) = end;
            group.add(triangle(viewport, at, velocity, site.person_radius, (fill, PERSON)))
        })
    })
}

fn over_time(
    site: &Site<'_>,
    courses: &[Course<'_>],
    traces: &[Option<TraceColumns>],
    size: (f64, f64),
) -> Group {
    let shown = || courses.iter().zip(traces).filter_map(|(c, trace)| Some((c, trace.as_ref()?)));
    let end = shown().filter_map(|(_, trace)| trace.time.last()).copied().fold(1.0, f64::max);
    let of = |value: fn(&TraceColumns) -> Vec<f64>| -> Vec<Curve<'_>> {
        let curve = |index, colour, trace: &TraceColumns| Curve {
            colour,
            width: if index == 0 { 2.2 } else { 1.4 },
            points: trace.time.iter().copied().zip(value(trace)).collect(),
        };
        shown().enumerate().map(|(index, (course, trace))| curve(index, course.colour, trace)).collect()
    };
    let chart = |title, scale, levels, curves| Chart {
        title,
        scale,
        across: (0.0, end),
        unit: "s",
        ticks: 8,
        uncertain: &[],
        snapshots: &[],
        levels,
        curves,
    };
    let uncertainty = of(|trace| trace.uncertainty.iter().map(|v| v.max(LEAST_UNCERTAINTY)).collect());
    let speed = of(|trace| trace.speed.clone());
    let (least, most) = range(&uncertainty, (site.threshold, site.threshold));
    let (slowest, fastest) = range(&speed, (0.0, 0.5));
    let uncertainty = chart(
        "Trace of the covariance of the estimated pose, m\u{b2} + rad\u{b2}",
        Scale::logarithmic(least / 1.3, most * 1.5),
        vec![(site.threshold, "Thr\u{2032}".to_owned())],
        uncertainty,
    );
    let speed = chart("Speed, m/s", Scale::linear(slowest * 1.08, fastest * 1.12), Vec::new(), speed);
    Group::new().add(uncertainty.draw(size)).add(speed.draw(size).set("transform", translate(0.0, size.1)))
}

/// The least and the greatest of the given two values and of those of all curves.
fn range(curves: &[Curve<'_>], (least, most): (f64, f64)) -> (f64, f64) {
    let values = curves.iter().flat_map(|c| c.points.iter().map(|p| p.1)).filter(|v| v.is_finite());
    values.fold((least, most), |(least, most), value| (least.min(value), most.max(value)))
}

fn legend(courses: &[Course<'_>], width: f64) -> Group {
    let rows = courses.len().div_ceil(2);
    let mut group = Group::new();
    for (index, course) in courses.iter().enumerate() {
        let (x, y) = ((index / rows) as f64 * width / 2.0, (index % rows) as f64 * ENTRY + 10.0);
        let bar = line((x, y), (x + 30.0, y), "").set("stroke", course.colour).set("stroke-width", 2.8);
        group = group.add(bar).add(text((x + 38.0, y + 4.0), "", course.name));
    }
    let foot = [
        "Strong: the run with the first seed, also in the plots. Faint: all runs.",
        "Grey floor: no landmark within the laser's range.",
        "Triangles: people in the strong run of the first planner, white at its start",
        "and filled at its end; they point where they walk.",
    ];
    foot.into_iter().enumerate().fold(group, |group, (i, words)| {
        group.add(text((0.0, rows as f64 * ENTRY + 14.0 + 15.0 * i as f64), "s", words))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    fn drawn(shown: Option<&RunResult>) -> String {
        let map = golden::occupancy_grid();
        let site = Site {
            id: "map-1",
            map: &map,
            bare: &vec![true; map.cells.len()],
            start: (0.0, 0.0),
            goal: (1.0, 1.0),
            goal_tolerance: 0.5,
            robot_radius: 0.3,
            person_radius: 0.25,
            threshold: 0.1,
        };
        let ways = vec![vec![(0.0, 0.0), (0.5, 0.2), (1.0, 1.0)]; 3];
        let name = "a <planner>";
        comparison_svg(&site, &[Course { name, colour: "#123456", ways, shown }])
    }

    #[test]
    fn every_way_is_drawn_and_names_are_escaped() {
        let svg = drawn(None);
        assert_eq!(svg.matches(r#"<polyline class="line""#).count(), 3);
        assert!(svg.contains("a &lt;planner&gt;") && !svg.contains("<planner>"));
        // The map and the floor without landmarks, each defined once and shown once.
        assert_eq!(svg.matches("map-1").count(), 4);
    }

    #[test]
    fn a_trace_adds_its_way_and_its_curves() {
        let mut result = golden::run_result();
        result.trace.columns =
            ["time_s", "true_x", "true_y", "cov_xx", "cov_yy", "cov_hh", "v"].map(String::from).to_vec();
        result.trace.values = (0..20)
            .map(|i| 0.1 * f64::from(i))
            .flat_map(|t| [t, t, 0.0, 0.1, 0.2 / (1.0 + t), 0.0, 1.0])
            .collect();
        result.trace.rows = 20;
        result.trace.people.rows = 0;
        let svg = drawn(Some(&result));
        // Three ways; halo, strong way, uncertainty and speed.
        assert_eq!(svg.matches(r#"<polyline class="line""#).count(), 3 + 4);
        assert!(!svg.contains("NaN") && !svg.contains("inf"));
    }
}
