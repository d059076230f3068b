//! The paper's scenes, redrawn from the only numbers it prints about them.
//!
//! The maps themselves are not published as data, so each is designed anew (A35) to have exactly the
//! published counts of known and landmark cells, people and laser range, and the three kinds of route
//! the paper argues with (D16): free but bare of landmarks, with landmarks but crowded, free with
//! landmarks. [`check`] measures all of that on the finished scene and trusts nothing of how it was drawn.
//!
//! Read in this order: [`Published`] (what is given), `env4` (how a scene is drawn), [`check`].

mod beats;
mod check;
mod env1;
mod env2;
mod env3;
mod env4;
mod files;
mod layout;
mod published;
mod quickstart;
mod report;
mod sight;
mod street;

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::RobotModel;
use curionav_planning::occupancy::{GridError, OccupancyGrid, StaticMap};
use curionav_planning::random::rng;
use curionav_planning::sensor::LaserModel;

use crate::scenario::{Clock, MapFile, Motion, RobotSetup, Scenario};
use beats::{BeatParams, points, rounded};
use layout::{Counts, Layout};

pub use check::check;
pub use files::{committed, files};
pub use layout::Polygon;
pub use published::{CELL_M, PUBLISHED, Published};
pub use quickstart::quickstart;
pub use report::{Report, RouteReport};
pub use street::zara01;

/// Seed of the committed scenes.
pub const SEED: u64 = 1;

/// What kind of way a route is (D16).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RouteKind {
    /// Free of people, for the greater part out of reach of any landmark.
    Bare,
    /// Along landmarks and through the crowd.
    Crowded,
    /// Free of people, along landmarks.
    Landmarks,
}

/// One way from start to goal that the scene offers.
#[derive(Debug, Clone, PartialEq)]
pub struct Route {
    /// What it is like.
    pub kind: RouteKind,
    /// Corners, the start first and the goal last, metres.
    pub way: Vec<Point2>,
}

/// A finished scene: map, scenario, and what it was meant to be.
#[derive(Debug, Clone)]
pub struct PaperScene {
    /// The static map with its distance fields.
    pub map: StaticMap,
    /// The scenario; its map file is the one [`files`] writes.
    pub scenario: Scenario,
    /// One route of each kind; none for scenes without that claim.
    pub routes: Vec<Route>,
    /// Zones that hold the beats.
    pub crowds: Vec<Polygon>,
    /// The published numbers it follows, if it is one of the paper's.
    pub published: Option<&'static Published>,
}

/// Why a scene could not be made.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum SceneError {
    /// Not one of the thirteen.
    #[error("the paper has no Env{environment} {scenario}; it has Env1 to Env4 with s1 to s3, and Env3 sx")]
    Unpublished {
        /// Environment asked for.
        environment: u8,
        /// Scenario asked for.
        scenario: String,
    },
    /// The floor plan cannot give the cells.
    #[error("the floor plan offers {found} {what} cells, {wanted} are wanted")]
    Counts {
        /// Kind of cell.
        what: &'static str,
        /// Cells to reach.
        wanted: usize,
        /// Cells there are.
        found: usize,
    },
    /// The crowd zones are too small or too cluttered.
    #[error("no room for another beat after {placed} people; enlarge the crowd zones")]
    NoRoom {
        /// People placed so far.
        placed: usize,
    },
    /// The scenario has no TOML form.
    #[error(transparent)]
    Toml(#[from] toml::ser::Error),
    /// The drawing is not a grid.
    #[error(transparent)]
    Grid(#[from] GridError),
}

/// A drawn floor plan with the task on it.
struct Plan {
    layout: Layout,
    start: Pose2,
    goal: Point2,
    routes: Vec<Route>,
    /// Crowd zones and their share of the people: the last takes the rest.
    crowds: Vec<(Polygon, f64)>,
    description: &'static str,
}

/// Makes one of the paper's scenes. `seed` draws the people's beats; the map is the same for every seed.
pub fn environment(environment: u8, scenario: &str, seed: u64) -> Result<PaperScene, SceneError> {
    let published = Published::find(environment, scenario)
        .ok_or_else(|| SceneError::Unpublished { environment, scenario: scenario.to_owned() })?;
    let plan = match environment {
        1 => env1::plan(scenario),
        2 => env2::plan(scenario),
        3 => env3::plan(scenario),
        _ => env4::plan(scenario),
    };
    let counts = Counts { known: published.known_cells, occupied: published.landmark_cells };
    let laser = LaserModel { range_max: rounded(published.laser_range()), ..LaserModel::default() };
    let name = format!("env{environment}-{scenario}");
    let grid = plan.layout.grid(CELL_M, Some(counts))?;
    // S* has the numbers of s1, but is to have other people.
    let seed = if published.hrvo { seed ^ (1 << 32) } else { seed };
    let mut scene = furnish(name, plan, grid, laser, published.people, BeatParams::default(), seed)?;
    if published.hrvo {
        scene.scenario.people.motion = Motion::Hrvo;
    }
    Ok(PaperScene { published: Some(published), ..scene })
}

/// All thirteen, in the order of Table II.
pub fn environments(seed: u64) -> Result<Vec<PaperScene>, SceneError> {
    PUBLISHED.iter().map(|p| environment(p.environment, p.scenario, seed)).collect()
}

/// Puts the people on a finished grid and writes the scenario.
fn furnish(
    name: String,
    plan: Plan,
    grid: OccupancyGrid,
    laser: LaserModel,
    people: usize,
    beats: BeatParams,
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
        beats::draw(&mut walkers, count, zone, &kept_free, &map, beats, &mut stream)?;
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
