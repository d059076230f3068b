//! A scenario before anything moves: where the robot starts, where it is to go, and what is in between.

use super::axes::{axes, scale_bar};
use super::map_layer::{area, definition, known, map_layer};
use super::page::{MAP_ID, RIM, printable};
use super::palette::{INK, TRUTH, style_sheet};
use super::symbols::{goal, path, person, robot, text};
use super::viewport::{Viewport, px};
use curionav_schemas::{OccupancyGrid, Pose};
use svg::node::element::{Definitions, Group, Polyline, Rectangle, SVG, Style, Title};

/// Greatest size of the map, px.
const SIZE: (f64, f64) = (900.0, 640.0);
/// Room for the numbers left of and below the map, px.
const AXIS: (f64, f64) = (34.0, 22.0);
/// Room for the title above and the explanation below, px.
const TITLE: f64 = 40.0;
const WORDS: f64 = 60.0;
/// Where no landmark is within the laser's range.
const BARE: (&str, &str) = ("bare", "#cfe3f2");

/// A person at the start.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Person {
    /// Position, m.
    pub at: (f64, f64),
    /// Velocity, m/s.
    pub velocity: (f64, f64),
}

/// A scenario before anything moves.
#[derive(Debug, Clone)]
pub struct SceneSketch<'a> {
    /// Its name.
    pub name: &'a str,
    /// What it is about, one line.
    pub description: &'a str,
    /// The map.
    pub map: &'a OccupancyGrid,
    /// For each cell of `map`, in its order: whether it is free and no landmark is within the laser's range.
    pub bare: Vec<bool>,
    /// The laser's range, m.
    pub laser_range: f64,
    /// Where the robot starts.
    pub start: Pose,
    /// Radius of the robot's body, m.
    pub robot_radius: f64,
    /// Where the robot is to go.
    pub goal: (f64, f64),
    /// Distance at which the goal counts as reached, m.
    pub goal_tolerance: f64,
    /// Points of the shortest path through which the robot's body fits; empty if there is none.
    pub shortest_path: Vec<(f64, f64)>,
    /// Everyone who is there at the start.
    pub people: Vec<Person>,
    /// Radius of a person, m.
    pub person_radius: f64,
    /// Waypoints of each person who walks a route.
    pub routes: Vec<Vec<(f64, f64)>>,
}

/// The scenario's map with start, goal, shortest path, people at the start, the routes of those who walk, and the area
/// where no landmark is within the laser's range.
pub fn scene_svg(scene: &SceneSketch<'_>) -> String {
    let map = scene.map;
    let viewport = Viewport::fit(known(map), SIZE.0, SIZE.1);
    let inside = SVG::new()
        .set("width", px(viewport.width))
        .set("height", px(viewport.height))
        .add(map_layer(map, BARE.0, &viewport))
        .add(map_layer(map, MAP_ID, &viewport))
        .add(routes(scene, &viewport))
        .add(shortest_path(scene, &viewport))
        .add(people(scene, &viewport))
        .add(goal(&viewport, scene.goal, scene.goal_tolerance))
        .add(start(scene, &viewport))
        .add(scale_bar(&viewport));
    let (width, height) =
        (viewport.width + AXIS.0 + 2.0 * RIM, viewport.height + AXIS.1 + 2.0 * RIM + TITLE + WORDS);
    let plan = Group::new()
        .set("transform", format!("translate({} {})", RIM + AXIS.0, RIM + TITLE))
        .add(axes(&viewport, 70.0))
        .add(inside);
    let below = RIM + TITLE + viewport.height + AXIS.1 + 18.0;
    let count = scene.people.len();
    let heading = format!(
        "{} \u{b7} {count} {} \u{b7} laser {} m",
        scene.name,
        if count == 1 { "person" } else { "people" },
        scene.laser_range
    );
    let document = SVG::new()
        .set("width", px(width))
        .set("height", px(height))
        .set("viewBox", format!("0 0 {} {}", px(width), px(height)))
        .add(Title::new(scene.name))
        .add(Style::new(style_sheet()))
        .add(Definitions::new().add(definition(map, MAP_ID)).add(area(&bare(scene), BARE.0, BARE.1)))
        .add(Rectangle::new().set("width", px(width)).set("height", px(height)).set("fill", "#fff"))
        .add(text((RIM, RIM + 20.0), "h1", heading))
        .add(plan)
        .add(lines(scene.description, (RIM + AXIS.0, below)));
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", printable(&document.to_string()))
}

const LEGEND: [&str; 2] = [
    "Ring: start. Star: goal. Dashed: shortest path. Discs: people at the start, with 0.8 s of their way.",
    "Thin lines: their routes. Blue: free, with no landmark within the laser's range.",
];

/// The description, and what is what, below each other.
fn lines(description: &str, (left, top): (f64, f64)) -> Group {
    let words = std::iter::once(description).chain(LEGEND).enumerate();
    words.fold(Group::new(), |group, (i, line)| group.add(text((left, top + 16.0 * i as f64), "s", line)))
}

fn routes(scene: &SceneSketch<'_>, viewport: &Viewport) -> Group {
    scene.routes.iter().fold(Group::new(), |group, route| {
        let points = viewport.points(route.iter().copied());
        group.add(Polyline::new().set("class", "track").set("points", points))
    })
}

fn people(scene: &SceneSketch<'_>, viewport: &Viewport) -> Group {
    scene.people.iter().fold(Group::new(), |group, one| {
        group.add(person(viewport, one.at, one.velocity, scene.person_radius))
    })
}

fn start(scene: &SceneSketch<'_>, viewport: &Viewport) -> Group {
    robot(viewport, (scene.start.x, scene.start.y), scene.start.heading, scene.robot_radius, INK)
}

fn shortest_path(scene: &SceneSketch<'_>, viewport: &Viewport) -> Polyline {
    path(viewport, scene.shortest_path.iter().copied(), TRUTH, 1.6).set("stroke-dasharray", "7 5")
}

/// A map that is unknown, which [`area`] draws, exactly in the bare cells.
fn bare(scene: &SceneSketch<'_>) -> OccupancyGrid {
    let cells: Vec<i8> = scene.bare.iter().map(|is_bare| if *is_bare { -1 } else { 0 }).collect();
    OccupancyGrid { cells: cells.into(), ..scene.map.clone() }
}
