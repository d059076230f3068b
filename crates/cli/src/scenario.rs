//! `curionav scenario`: checking and generating scenario files.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use clap::Subcommand;
use curionav_deployment::scenario_reference::scenario_reference;
use curionav_lab::{paper, suites};
use curionav_picture::{Person, SceneSketch, scene_svg};
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::{Cell, GeodesicField, OccupancyGrid, StaticMap};
use curionav_runtime::convert;
use curionav_schemas::Clock;

use curionav_deployment::built_in;
use curionav_deployment::files;
use curionav_deployment::package::{self, Choice, Package};
use curionav_in_process::Prepared;
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::fields::Fields;
use curionav_runtime::print::{note, print};

use crate::things::things;

/// Check, draw, copy or generate scenario files.
#[derive(Debug, Subcommand)]
pub(crate) enum ScenarioCommand {
    /// Check scenario files and the maps and recordings they name.
    Check {
        /// Scenario files.
        #[arg(required = true, value_name = "SCENARIO.toml")]
        files: Vec<PathBuf>,
        /// Seed that draws the people of `[[crowds]]`.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Draw scenarios before anything moves, NAME.svg each: map, start, goal, shortest path, people and their
    /// routes, and where no landmark is within the laser's range.
    Draw {
        /// Scenario files.
        #[arg(required = true, value_name = "SCENARIO.toml")]
        files: Vec<PathBuf>,
        /// Directory to write into.
        #[arg(long, value_name = "DIR", default_value = ".")]
        out: PathBuf,
        /// Seed that draws the people of `[[crowds]]`.
        #[arg(long, default_value_t = 1)]
        seed: u64,
    },
    /// Print the reference page of the scenario file, docs/scenario.md: every field with its range.
    Reference,
    /// Write the built-in scenario `quickstart` and its map, as a start for your own.
    Copy {
        /// Directory to write into.
        #[arg(value_name = "DIR")]
        out: PathBuf,
    },
    /// Write the generated scenarios and their maps, as committed under scenarios/.
    Generate {
        /// Directory to write into.
        #[arg(value_name = "DIR")]
        out: PathBuf,
    },
}

pub(crate) fn run(command: ScenarioCommand) -> Result<u8, Exit> {
    match command {
        ScenarioCommand::Check { files, seed } => {
            for file in &files {
                print(check(file, seed).map_err(Exit::bad_input)?)?;
            }
        }
        ScenarioCommand::Draw { files, out, seed } => {
            for file in &files {
                print(draw(file, &out, seed).map_err(Exit::bad_input)?.display())?;
            }
        }
        ScenarioCommand::Copy { out } => {
            for file in built_in::write_all(&out).map_err(Exit::failed)? {
                print(file.display())?;
            }
        }
        ScenarioCommand::Generate { out } => {
            for scene in generate(&out).map_err(Exit::bad_input)? {
                print(scene)?;
            }
        }
        ScenarioCommand::Reference => print(scenario_reference().map_err(Exit::failed)?.trim_end())?,
    }
    Ok(SUCCESS)
}

fn package(file: &Path, seed: u64) -> anyhow::Result<Package> {
    let choice = Choice { seed: Some(seed), ..Choice::default() };
    package::read(file, &choice, Clock::Lockstep, 1.0)
}

/// A scenario as it would be run. What does not fit its map may not fit because of how the map is read.
fn prepared(package: &Package) -> anyhow::Result<Prepared> {
    curionav_in_process::prepare(&package.request, "robot", &Fields::of_maps([])).map_err(|reject| {
        let refusal = package.refusal(&reject);
        let Ok(survey) = package.survey() else { return refusal };
        if survey.odd.is_empty() && reject.field.is_none_or(|field| !field.starts_with("robot.")) {
            return refusal;
        }
        let odd: String = survey.odd.iter().map(|odd| format!("; {odd}")).collect();
        anyhow!("{refusal}; the map is {survey}{odd}")
    })
}

/// Draws a scenario; gives the file.
fn draw(file: &Path, out: &Path, seed: u64) -> anyhow::Result<PathBuf> {
    let package = package(file, seed)?;
    let prepared = prepared(&package)?;
    let name = file.file_stem().with_context(|| format!("{} is not a file", file.display()))?;
    let picture = out.join(name).with_extension("svg");
    files::write(&picture, scene_svg(&sketch(&package, &prepared)))?;
    Ok(picture)
}

/// Points of the shortest path are this far apart, metres.
const SPACING_M: f64 = 0.2;

/// What of a scenario is drawn.
fn sketch<'a>(package: &Package, prepared: &'a Prepared) -> SceneSketch<'a> {
    let world = &prepared.world;
    let scenario = world.scenario();
    let map = world.map();
    let people = world.people();
    let robot = &scenario.robot;
    let range = scenario.laser.range_max;
    let field = GeodesicField::new(map, robot.goal, robot.model.radius());
    let path = field.descend(robot.start.position(), SPACING_M);
    SceneSketch {
        name: &scenario.name,
        description: &scenario.description,
        map: &prepared.map,
        walls: prepared.truth.as_ref().unwrap_or(&prepared.map),
        things: things(package),
        bare: prepared.bare(),
        laser_range: range,
        start: convert::pose_to_wire(robot.start),
        robot_radius: robot.model.radius(),
        goal: xy(robot.goal),
        goal_tolerance: robot.goal_tolerance,
        shortest_path: path.into_iter().map(xy).collect(),
        people: (0..people.len())
            .map(|i| Person { at: (people.x[i], people.y[i]), velocity: (people.vx[i], people.vy[i]) })
            .collect(),
        person_radius: people.radius,
        routes: scenario.walkers.iter().map(|w| w.route.iter().copied().map(xy).collect()).collect(),
    }
}

fn xy(point: Point2) -> (f64, f64) {
    (point.x, point.y)
}

/// What a scenario that can be run holds: a line, and one for each recording.
fn check(file: &Path, seed: u64) -> anyhow::Result<String> {
    let package = package(file, seed)?;
    let prepared = prepared(&package)?;
    let scenario = prepared.world.scenario();
    let map = &prepared.map;
    let mut said = format!(
        "{}: fine; {} x {} cells of {} m, {} walkers ({} of them drawn), {} recordings, planner {}",
        file.display(),
        map.width,
        map.height,
        map.resolution,
        scenario.walkers.len(),
        scenario.people_drawn(),
        scenario.recorded.len(),
        prepared.profile.name
    );
    let survey = package.survey()?;
    said += &format!("\n  map: {survey}");
    said.extend(survey.odd.iter().map(|odd| format!("\n  map is odd: {odd}")));
    said.extend(zones(prepared.world.map()));
    if let Some(narrow) = scenario.too_narrow(prepared.world.map()) {
        said += &format!("\n  {narrow}");
    }
    for (setup, extent) in scenario.recorded.iter().zip(prepared.world.recorded()) {
        let people = extent.people;
        let (first, last) = extent.span;
        let (low, high) = extent.corners;
        said += &format!(
            "\n  {}: {people} people, {first:.1} to {last:.1} s, x {:.1} to {:.1} m, y {:.1} to {:.1} m, \
             {:.0} % of the way on the free floor",
            setup.file,
            low.x,
            high.x,
            low.y,
            high.y,
            100.0 * extent.on_floor
        );
        if let (Some(usual), Some(fastest)) = (extent.usual_speed, extent.fastest) {
            said += &format!(", walking at {usual:.2} m/s (median), at most {:.2} m/s", fastest.speed);
        }
        said.extend(extent.odd().iter().map(|odd| format!("\n  {} is odd: {odd}", setup.file)));
    }
    Ok(said)
}

/// How much of the free floor of a map is in zones, if it has any.
fn zones(map: &StaticMap) -> Option<String> {
    let grid = &map.grid;
    if grid.limits().is_empty() {
        return None;
    }
    let free = (0..grid.cells().len()).filter(|index| grid.cell(*index) == Cell::Free);
    let limits: Vec<u8> = free.map(|index| grid.limit(index)).collect();
    let kept_out = limits.iter().filter(|limit| **limit == 0).count();
    let slow: Vec<u8> =
        limits.iter().copied().filter(|limit| (1..OccupancyGrid::NO_LIMIT).contains(limit)).collect();
    let kept_out = percent(kept_out, limits.len());
    let slowest =
        slow.iter().min().map_or(String::new(), |share| format!(", down to {share} % of the greatest speed"));
    let slow = percent(slow.len(), limits.len());
    Some(format!("\n  zones: {kept_out:.1} % of the free floor is kept out, {slow:.1} % is slow{slowest}"))
}

/// A part of a number in per cent; none of none.
fn percent(part: usize, of: usize) -> f64 {
    100.0 * part as f64 / of.max(1) as f64
}

/// Writes the scenes, which are drawn from a fixed seed, so that what is written is what is committed. Gives what the
/// drawn ones turned out to be like, for those who change the drawing.
fn generate(out: &Path) -> anyhow::Result<Vec<String>> {
    let (generated, missing) = suites::committed()?;
    for (name, bytes) in generated {
        files::write(&out.join(name), bytes)?;
    }
    missing.iter().for_each(|missing| note(format_args!("left out: {missing}")));
    let scenes = paper::environments(paper::SEED)?.into_iter().chain([paper::quickstart(paper::SEED)?]);
    Ok(scenes.map(|scene| format!("{}\n{}", scene.scenario.name, paper::check(&scene))).collect())
}
