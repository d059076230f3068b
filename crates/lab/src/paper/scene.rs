//! A finished scene, and what it was meant to be.

use curionav_crowdsim::Scenario;
use curionav_crowdsim::scenario::{MapFile, RobotSetup};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::RobotModel;
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::random::rng;
use curionav_planning::sensor::LaserModel;

use super::drawing::Plan;
use super::patrol::{draw, points, rounded};
use super::published::Published;
use super::route::{Route, RouteKind};

/// A finished scene: map, scenario, and what it was meant to be.
#[derive(Debug, Clone)]
pub struct PaperScene {
    pub(crate) map: StaticMap,
    /// The scenario; its map file is the one that [`super::committed`] gives.
    pub scenario: Scenario,
    /// One route of each kind; none for scenes without that claim.
    pub(super) routes: Vec<Route>,
    /// The published numbers it follows, if it is one of the paper's.
    pub(super) published: Option<&'static Published>,
}

impl PaperScene {
    pub(super) fn furnish(
        name: &str,
        plan: Plan,
        grid: OccupancyGrid,
        laser: LaserModel,
        people: usize,
        seed: u64,
    ) -> anyhow::Result<Self> {
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
            draw(&mut walkers, count, zone, &kept_free, &map, &plan.patrols, &mut stream)?;
        }
        let file = format!("maps/{name}.yaml");
        let task = task(name, &plan.description, &file, plan.start, plan.goal);
        let scenario = Scenario { laser, walkers, ..task };
        Ok(Self { map, scenario, routes: plan.routes, published: None })
    }
}

/// A scenario with everything at its default but its task, and without people.
pub(crate) fn task(name: &str, description: &str, map_file: &str, start: Pose2, goal: Point2) -> Scenario {
    Scenario {
        map: MapFile::plain(map_file.to_owned()),
        name: name.to_owned(),
        description: description.to_owned(),
        robot: RobotSetup {
            start,
            goal,
            goal_heading: None,
            goal_tolerance: 0.5,
            initial_sigma: [0.5, 0.5, rounded(std::f64::consts::PI / 12.0)],
            start_noise: 0.5,
            model: RobotModel::default(),
        },
        laser: Default::default(),
        laser_faults: Default::default(),
        world: Default::default(),
        odometry_noise: Default::default(),
        perception: Default::default(),
        clock: Default::default(),
        people: Default::default(),
        walkers: Vec::new(),
        crowds: Vec::new(),
        recorded: Vec::new(),
        planner: Default::default(),
        localizer: None,
        tracker: None,
        profile: None,
    }
}
