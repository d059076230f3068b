//! RRT* alone on the map of a depot, 30 m x 15 m, as long as a peer was given.

use std::path::Path;
use std::rc::Rc;
use std::time::{Duration, Instant};

use anyhow::Context;
use curionav_planning::collision::{CollisionChecker, CollisionParams};
use curionav_planning::forecast::ForecastParams;
use curionav_planning::generation::{Landmarks, Pace, PoseTree, RrtStar, RrtStarParams, SampleSpace};
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::RobotModel;
use curionav_planning::nalgebra::Matrix3;
use curionav_planning::occupancy::{MapYaml, StaticMap, load_map};
use curionav_planning::random::rng;
use curionav_planning::scene::{Belief, People, Scene};
use curionav_runtime::print::note;

use crate::case::{Case, Sample};

const MAP: &str = "dataset:maps_nav2_turtlebot/depot.yaml";
/// From the map's lower left corner, metres.
const START: (f64, f64) = (3.0, 3.0);
const GOAL: (f64, f64) = (27.0, 12.0);
/// What counts as the goal, metres.
const TOLERANCE: f64 = 0.5;
/// More than three seconds of samples.
const MAX_NODES: u32 = 200_000;
/// Samples between two looks at the clock.
const BATCH: u32 = 100;

/// A second and three of growth; the time is that of one sample. Nothing where the dataset is missing.
pub(crate) fn cases() -> anyhow::Result<Vec<Case>> {
    let file = match curionav_datasets::locate(MAP, Path::new("")) {
        Ok(file) => file,
        Err(missing) => {
            note(format_args!("rrt-star/depot is left out: {missing}"));
            return Ok(Vec::new());
        }
    };
    let yaml = MapYaml::parse(&std::fs::read_to_string(&file)?)?;
    let image = std::fs::read(file.parent().context("the map is a file")?.join(&yaml.image))?;
    let map = Rc::new(StaticMap::new(load_map(&yaml, &image)?));
    // As the peer drives: every sample that can be reached becomes a node.
    let mut peer = RrtStarParams::default();
    (peer.max_nodes, peer.turning_radius, peer.spacing) = (MAX_NODES, 0.5, 0.0);
    // As the planner has it, which refuses a node beside another.
    let mut own = RrtStarParams::default();
    own.max_nodes = MAX_NODES;
    let of = |name: &str, params: RrtStarParams, seconds| {
        let map = Rc::clone(&map);
        let time = Duration::from_secs(seconds);
        Case::long(format!("rrt-star/{name}/{seconds}s"), move || grow(&map, &params, time))
    };
    Ok(vec![
        of("depot", peer, 1),
        of("depot", peer, 3),
        of("depot-spaced", own, 1),
        of("depot-spaced", own, 3),
    ])
}

fn grow(map: &StaticMap, params: &RrtStarParams, time: Duration) -> Sample {
    let origin = map.grid.origin();
    let at = |(x, y): (f64, f64)| Point2::new(origin.x + x, origin.y + y);
    let start = at(START);
    let goal = at(GOAL);
    let belief = Belief {
        pose: Pose2::new(start.x, start.y, 0.0),
        covariance: Matrix3::zeros(),
        twist: Twist::default(),
    };
    let people = People { radius: 0.25, ..People::default() };
    let scene = Scene::new(belief, people);
    let forecast = ForecastParams::default();
    let collision = CollisionParams::default();
    let robot = RobotModel::default();
    let checker = CollisionChecker::new(map, &robot, &scene, forecast, &collision);
    let middle = at((0.5 * (START.0 + GOAL.0), 0.5 * (START.1 + GOAL.1)));
    let space = SampleSpace {
        grid: &map.grid,
        centre: middle,
        radius: 17.0,
        way: &[],
        landmarks: &Landmarks::default(),
    };

    let mut search = RrtStar::new(params, &checker, &space, PoseTree::rooted(scene.belief.pose));
    let mut random = rng(1, 0);
    let mut samples = 0;
    let pace = Pace::new(&|| 0.0);
    let started = Instant::now();
    while started.elapsed() < time {
        search.grow(BATCH, &mut random, &pace);
        samples += BATCH;
    }
    let taken = started.elapsed();
    let tree = search.into_tree();
    let at_goal = (0..tree.len()).filter(|&i| tree.position(i).distance(goal) < TOLERANCE);
    let length = at_goal.map(|i| tree.cost[i]).min_by(f64::total_cmp);
    let length = length.map_or_else(|| "no way".to_owned(), |metres| format!("{metres:.2} m"));
    Sample { time: taken / samples, note: format!("{samples} samples, {length}") }
}
