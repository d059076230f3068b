//! A scenario before anything moves: where the robot starts, where it is to go, and what is in between.

use super::axes::{AXIS, on_axes, scale_bar};
use super::map_layer::{area, definition, known, map_layer, zones, zones_and_walls};
use super::page::{MAP_ID, RIM, document, file, pane};
use super::palette::{INK, TRUTH};
use super::symbols::{goal, path, person, robot, text, tracks};
use super::thing::{Thing, things};
use super::viewport::Viewport;
use curionav_schemas::{OccupancyGrid, Pose};
use svg::node::element::{Definitions, Group, SVG};

/// Greatest size of the map, px.
const SIZE: (f64, f64) = (900.0, 640.0);
/// Room for the title above and the explanation below, px.
const TITLE: f64 = 40.0;
const WORDS: f64 = 60.0;
/// Room for one line more, px.
const LINE: f64 = 16.0;
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
    /// Name of the scenario.
    pub name: &'a str,
    /// What it is about, one line.
    pub description: &'a str,
    /// The map that the robot is given, with its zones.
    pub map: &'a OccupancyGrid,
    /// The walls that are really there: those of the map, or others.
    pub walls: &'a OccupancyGrid,
    /// What is there besides the map.
    pub things: Vec<Thing>,
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
    /// The people who are there at the start.
    pub people: Vec<Person>,
    /// Radius of a person, m.
    pub person_radius: f64,
    /// Waypoints of each person who walks a route.
    pub routes: Vec<Vec<(f64, f64)>>,
}

/// The scenario's map with start, goal, shortest path, people at the start, the routes of those who walk, and the area
/// where no landmark is within the laser's range.
pub fn scene_svg(scene: &SceneSketch<'_>) -> String {
    let SceneSketch { name, map, start, people, .. } = scene;
    let viewport = Viewport::fit(known(scene.walls), SIZE.0, SIZE.1);
    let at_start = people.iter().fold(Group::new(), |group, one| {
        group.add(person(&viewport, one.at, one.velocity, scene.person_radius))
    });
    let shortest = path(&viewport, scene.shortest_path.iter().copied(), TRUTH, 1.6);
    let floor = zones_and_walls(map, (scene.walls, MAP_ID), &viewport);
    let inside = floor
        .fold(pane(viewport.width, viewport.height).add(map_layer(map, BARE.0, &viewport)), SVG::add)
        .add(things(&viewport, &scene.things))
        .add(tracks(&viewport, scene.routes.iter().cloned()))
        .add(shortest.set("stroke-dasharray", "7 5"))
        .add(at_start)
        .add(goal(&viewport, scene.goal, scene.goal_tolerance))
        .add(robot(&viewport, (start.x, start.y), start.heading, scene.robot_radius, INK))
        .add(scale_bar(&viewport));
    let width = viewport.width + AXIS.0 + 2.0 * RIM;
    let more = LINE * (words_besides(scene).len() as f64);
    let height = viewport.height + AXIS.1 + 2.0 * RIM + TITLE + WORDS + more;
    let plan = on_axes(&viewport, inside, (RIM, RIM + TITLE));
    let below = RIM + TITLE + viewport.height + AXIS.1 + 18.0;
    let noun = if people.len() == 1 { "person" } else { "people" };
    let heading = format!("{name} \u{b7} {} {noun} \u{b7} laser {} m", people.len(), scene.laser_range);
    let heading = text((RIM, RIM + 20.0), "h1", heading);
    let bare = area(map, &scene.bare, BARE.0, BARE.1);
    let definitions = Definitions::new().add(definition(scene.walls, MAP_ID)).add(bare);
    let definitions = zones(map).into_iter().fold(definitions, Definitions::add);
    let words = lines(scene, (RIM + AXIS.0, below));
    file(&document(name, (width, height), definitions).add(heading).add(plan).add(words))
}

const LEGEND_OF_THINGS: &str =
    "Ochre: things on no map, dashed if they come, go or are pushed. Dotted: walls of the map that are gone.";
const LEGEND_OF_ZONES: &str =
    "Red: the robot must not drive there. Orange: there it is slow, the darker the slower.";
const LEGEND: [&str; 2] = [
    "Ring: start. Star: goal. Dashed: shortest path. Discs: people at the start, with 0.8 s of their way.",
    "Thin lines: their routes. Blue: free, with no landmark within the laser's range.",
];

fn lines(scene: &SceneSketch<'_>, (left, top): (f64, f64)) -> Group {
    let words = std::iter::once(scene.description).chain(LEGEND).chain(words_besides(scene)).enumerate();
    words.fold(Group::new(), |group, (i, line)| group.add(text((left, top + LINE * i as f64), "s", line)))
}

/// What is explained where it is to be seen.
fn words_besides(scene: &SceneSketch<'_>) -> Vec<&'static str> {
    let of_things = (!scene.things.is_empty()).then_some(LEGEND_OF_THINGS);
    let of_zones = scene.map.limits.is_some().then_some(LEGEND_OF_ZONES);
    of_things.into_iter().chain(of_zones).collect()
}
