//! A drawn floor plan, and the people who are put on it.

use curionav_crowdsim::Scenario;
use curionav_crowdsim::scenario::{Clock, MapFile, RobotSetup};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::RobotModel;
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::random::rng;
use curionav_planning::sensor::LaserModel;

use super::layout::{Layout, Polygon};
use super::patrol::{PatrolParams, draw, points, rounded};
use super::scene::{PaperScene, Route, RouteKind};
use super::scene_error::SceneError;

/// A drawn floor plan with the task on it.
pub(super) struct Plan {
    pub(super) layout: Layout,
    pub(super) start: Pose2,
    pub(super) goal: Point2,
    pub(super) routes: Vec<Route>,
    /// Crowd zones and their share of the people: the last takes the rest.
    pub(super) crowds: Vec<(Polygon, f64)>,
    pub(super) description: &'static str,
}

/// Puts the people on a finished grid and writes the scenario.
pub(super) fn furnish(
    name: String,
    plan: Plan,
    grid: OccupancyGrid,
    laser: LaserModel,
    people: usize,
    patrols: PatrolParams,
    seed: u64,
) -> Result<PaperScene, SceneError> {
    let map = StaticMap::new(grid);
    let mut kept_free = vec![plan.start.position(), plan.goal];
    for route in plan.routes.iter().filter(|r| r.kind != RouteKind::Crowded) {
        kept_free.extend(points(&route.way, 0.1));
    }
    let mut walkers = Vec::with_capacity(people);
    for (k, (zone, share)) in plan.crowds.iter().enumerate() {
        let last = k + 1 == plan.crowds.len();
        let left = people - walkers.len();
        let count = if last { left } else { ((share * people as f64).round() as usize).min(left) };
        let mut stream = rng(seed, k as u64);
        draw(&mut walkers, count, zone, &kept_free, &map, patrols, &mut stream)?;
    }
    let scenario = Scenario {
        map: MapFile { file: format!("maps/{name}.yaml") },
        name,
        description: plan.description.to_owned(),
        robot: RobotSetup {
            start: plan.start,
            goal: plan.goal,
            goal_heading: None,
            goal_tolerance: 0.5,
            initial_sigma: [0.5, 0.5, rounded(std::f64::consts::PI / 12.0)],
            start_noise: 0.5,
            model: RobotModel::default(),
        },
        laser,
        odometry_noise: Default::default(),
        perception: Default::default(),
        clock: Clock::default(),
        people: Default::default(),
        walkers,
        recorded: Vec::new(),
        planner: Default::default(),
        localizer: None,
        profile: None,
    };
    let crowds = plan.crowds.into_iter().map(|(zone, _)| zone).collect();
    Ok(PaperScene { map, scenario, routes: plan.routes, crowds, published: None })
}
