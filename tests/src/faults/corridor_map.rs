//! Where the robot drives: a long hall with two pillars, planned for with few candidates.

use std::sync::OnceLock;

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::RobotModel;
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::profile::Profile;
use curionav_planning::sensor::LaserModel;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_schemas::{Clock, MapId, Mission, MissionState};
use curionav_testing::golden;

/// Metres.
const LENGTH: f64 = 30.0;
const WIDTH: f64 = 8.0;
const CELL: f64 = 0.2;
pub(crate) const START: Point2 = Point2 { x: 2.0, y: 4.0 };
pub(crate) const GOAL: Point2 = Point2 { x: 28.0, y: 4.0 };

/// Its map with everything derived from it, shared by all who are prepared.
pub(crate) fn fields() -> (Fields, MapId) {
    static ALL: OnceLock<(Fields, MapId)> = OnceLock::new();
    ALL.get_or_init(derive).clone()
}

fn derive() -> (Fields, MapId) {
    let (columns, rows) = ((LENGTH / CELL) as usize, (WIDTH / CELL) as usize);
    let occupied = |x: usize, y: usize| {
        let (px, py) = (x as f64 * CELL, y as f64 * CELL);
        let pillar = |at: f64| (px - at).abs() < 0.3 && (py - 2.0).abs() < 0.3;
        x == 0 || y == 0 || x + 1 == columns || y + 1 == rows || pillar(9.0) || pillar(18.0)
    };
    let cells = (0..rows).flat_map(|y| (0..columns).map(move |x| (x, y)));
    let cells = cells.map(|(x, y)| if occupied(x, y) { 100 } else { 0 }).collect();
    let grid = OccupancyGrid::new(columns, rows, CELL, Pose2::default(), cells).unwrap();
    let id = MapId(grid.hash());
    (Fields::of_maps([StaticMap::new(grid)]), id)
}

/// A planner that is quick: small trees, short and few candidates.
fn profile(trees: u32) -> Profile {
    let mut profile = Profile::default();
    (profile.steps, profile.trees) = (8, trees);
    let tree = &mut profile.generation.tree;
    (tree.iterations, tree.warm_up, tree.max_nodes) = (12, 40, 80);
    let candidates = &mut profile.generation.candidates;
    (candidates.max_candidates, candidates.min_candidates, candidates.max_branches) = (36, 4, 12);
    // With so few it must not be picky about people, or it ends up along the wall with none.
    profile.terms.values_mut().for_each(|term| term.weight = 1.0);
    profile
}

/// Gives a mission another profile.
pub(crate) fn change_profile(mission: &mut Mission, change: impl FnOnce(&mut Profile)) {
    let mut profile: Profile = convert::from_value("profile", &mission.order.profile).unwrap();
    change(&mut profile);
    mission.order.profile = convert::to_value(&profile).unwrap();
}

/// The mission to drive to the far end, with that many trees.
pub(crate) fn mission(map: MapId, seed: u64, clock: Clock, trees: u32) -> Mission {
    let laser = LaserModel { range_max: 5.0, beams: 31, ..LaserModel::default() };
    let mut mission = golden::mission();
    mission.order.initial_doubtful = false;
    mission.order.map = map;
    mission.order.initial_pose = convert::pose_to_wire(Pose2::new(START.x, START.y, 0.0));
    (mission.order.goal_x, mission.order.goal_y, mission.order.goal_heading) = (GOAL.x, GOAL.y, None);
    mission.order.profile = convert::to_value(&profile(trees)).unwrap();
    mission.order.laser = convert::laser_to_wire(&laser);
    mission.order.robot_model = convert::robot_model_to_wire(&RobotModel::default());
    (mission.order.seed, mission.order.clock, mission.state) = (seed, clock, MissionState::Running);
    mission
}
