//! A scenario before anything moves: where the robot starts, where it is to go, and what is in between.

use super::axes::{axes, scale_bar};
use super::floor::{area, definition, floor, known};
use super::palette::{INK, TRUTH, style_sheet};
use super::symbols::{goal, path, person, robot, text};
use super::window::{Window, px};
use super::{FLOOR, RIM, printable};
use curionav_crowdsim::World;
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::GeodesicField;
use curionav_schemas::OccupancyGrid;
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
/// Points of the shortest way are this far apart, metres.
const SPACING_M: f64 = 0.2;

/// The scenario's map with start, goal, shortest way, everybody at the start, the routes of those who walk, and where
/// no landmark is within the laser's range.
pub(crate) fn scene_svg(world: &World, map: &OccupancyGrid) -> String {
    let scenario = world.scenario();
    let window = Window::fit(known(map), SIZE.0, SIZE.1);
    let inside = SVG::new()
        .set("width", px(window.width))
        .set("height", px(window.height))
        .add(floor(map, BARE.0, &window))
        .add(floor(map, FLOOR, &window))
        .add(routes(world, &window))
        .add(shortest_way(world, &window))
        .add(people(world, &window))
        .add(goal(&window, at(scenario.robot.goal), scenario.robot.goal_tolerance))
        .add(start(world, &window))
        .add(scale_bar(&window));
    let (width, height) =
        (window.width + AXIS.0 + 2.0 * RIM, window.height + AXIS.1 + 2.0 * RIM + TITLE + WORDS);
    let plan = Group::new()
        .set("transform", format!("translate({} {})", RIM + AXIS.0, RIM + TITLE))
        .add(axes(&window, 70.0))
        .add(inside);
    let below = RIM + TITLE + window.height + AXIS.1 + 18.0;
    let count = world.people().len();
    let heading = format!(
        "{} \u{b7} {count} {} \u{b7} laser {} m",
        scenario.name,
        if count == 1 { "person" } else { "people" },
        scenario.laser.range_max
    );
    let document = SVG::new()
        .set("width", px(width))
        .set("height", px(height))
        .set("viewBox", format!("0 0 {} {}", px(width), px(height)))
        .add(Title::new(scenario.name.as_str()))
        .add(Style::new(style_sheet()))
        .add(Definitions::new().add(definition(map, FLOOR)).add(area(&bare(world, map), BARE.0, BARE.1)))
        .add(Rectangle::new().set("width", px(width)).set("height", px(height)).set("fill", "#fff"))
        .add(text((RIM, RIM + 20.0), "h1", heading))
        .add(plan)
        .add(lines(&scenario.description, (RIM + AXIS.0, below)));
    format!("<?xml version=\"1.0\" encoding=\"UTF-8\"?>\n{}\n", printable(&document.to_string()))
}

const LEGEND: [&str; 2] = [
    "Ring: start. Star: goal. Dashed: shortest way. Discs: people at the start, with 0.8 s of their way.",
    "Thin lines: their routes. Blue: free, with no landmark within the laser's range.",
];

/// The description, and what is what, below each other.
fn lines(description: &str, (left, top): (f64, f64)) -> Group {
    let words = std::iter::once(description).chain(LEGEND).enumerate();
    words.fold(Group::new(), |group, (i, line)| group.add(text((left, top + 16.0 * i as f64), "s", line)))
}

fn at(point: Point2) -> (f64, f64) {
    (point.x, point.y)
}

fn routes(world: &World, window: &Window) -> Group {
    world.scenario().walkers.iter().fold(Group::new(), |group, walker| {
        let points = window.points(walker.route.iter().copied().map(at));
        group.add(Polyline::new().set("class", "track").set("points", points))
    })
}

fn people(world: &World, window: &Window) -> Group {
    let people = world.people();
    (0..people.len()).fold(Group::new(), |group, i| {
        group.add(person(window, (people.x[i], people.y[i]), (people.vx[i], people.vy[i]), people.radius))
    })
}

fn start(world: &World, window: &Window) -> Group {
    let setup = &world.scenario().robot;
    robot(window, at(setup.start.position()), setup.start.heading, setup.model.radius(), INK)
}

/// As the robot's body fits through; nothing where there is no way.
fn shortest_way(world: &World, window: &Window) -> Polyline {
    let (setup, map) = (&world.scenario().robot, world.map());
    let field = GeodesicField::new(&map.grid, &map.to_obstacle, setup.goal, setup.model.radius());
    let way = field.descend(&map.grid, setup.start.position(), SPACING_M);
    path(window, way.into_iter().map(at), TRUTH, 1.6).set("stroke-dasharray", "7 5")
}

/// The map with less than nothing where it is free and no landmark is within the laser's range.
fn bare(world: &World, map: &OccupancyGrid) -> OccupancyGrid {
    let (grid, field) = (&world.map().grid, &world.map().to_occupied);
    let range = world.scenario().laser.range_max;
    let cells = (map.cells.iter().enumerate())
        .map(|(i, cell)| {
            if *cell == 0 && field.at(grid, grid.centre(i % grid.width(), i / grid.width())) > range {
                -1
            } else {
                0
            }
        })
        .collect::<Vec<i8>>();
    OccupancyGrid { cells: cells.into(), ..map.clone() }
}
