//! A robot that is longer than wide stands with its nose in a niche in which it cannot turn.

use nalgebra::Matrix3;

use super::*;
use crate::footprint::FootprintShape;
use crate::geometry::Twist;
use crate::motion::{Footprint, step};
use crate::occupancy::OccupancyGrid;
use crate::random::{rng, uniform};
use crate::tracking::track;

/// Where the niche begins, metres.
const MOUTH: f64 = 5.0;

fn is_wall(column: i32, row: i32) -> bool {
    let is_edge = [0, 159].contains(&column) || [0, 119].contains(&row);
    let is_niche = (100..120).contains(&column) && (53..68).contains(&row);
    is_edge || column >= 100 && !is_niche
}

/// A hall of 8 m by 6 m with a niche of 0.75 m in the east, in cells of 0.05 m.
fn hall() -> Arc<StaticMap> {
    let cells = (0..160 * 120).map(|i| if is_wall(i % 160, i / 160) { 100 } else { 0 }).collect();
    Arc::new(StaticMap::new(OccupancyGrid::new(160, 120, 0.05, Pose2::default(), cells).unwrap()))
}

fn robot(v_reverse: f64) -> RobotModel {
    let corners = [(-0.45, -0.25), (0.45, -0.25), (0.45, 0.25), (-0.45, 0.25)];
    let vertices = corners.map(|(x, y)| Point2::new(x, y)).to_vec();
    RobotModel { footprint: Footprint::Polygon { vertices }, v_reverse, ..RobotModel::default() }
}

/// Seconds until the robot is a metre away from where it was put, on its way to the goal; none if it is not within
/// half a minute. It must touch no wall.
fn seconds_to_leave(profile: &Profile, robot: &RobotModel, laser: LaserModel, seed: u64) -> Option<f64> {
    let map = hall();
    let mut planner = Planner::new(Arc::clone(&map), profile.clone(), robot.clone()).unwrap();
    planner = planner.with_laser(laser).with_seed(seed);
    planner.set_goal(Point2::new(1.5, 1.5)).unwrap();
    let mut r = rng(seed, 0);
    let mut within = |most: f64| most * (2.0 * uniform(&mut r) - 1.0);
    let start = Pose2::new(MOUTH - 0.1 + within(0.1), 3.025 + within(0.03), within(0.05));
    let shape = FootprintShape::from(&robot.footprint);
    let mut pose = start;
    let mut twist = Twist::default();
    for tick in 0..100 {
        let covariance = Matrix3::from_diagonal_element(1e-4);
        let belief = Belief { pose, covariance, twist };
        let verdict = planner.cycle(belief, &People::default(), 0.3 * f64::from(tick)).unwrap();
        for k in 0..3 {
            twist = track(&verdict.decision.trajectory, 0.1 * f64::from(k), pose, twist, robot, 0.1);
            pose = step(pose, twist, 0.1);
            assert!(!shape.comes_within(pose, &map, 0.0), "seed {seed}: it touches a wall at {pose:?}");
        }
        if pose.position().distance(start.position()) > 1.0 {
            return Some(0.3 * f64::from(tick + 1));
        }
    }
    None
}

#[test]
fn a_robot_that_cannot_turn_leaves_backwards_where_its_laser_sees() {
    let mut profile = Profile::default();
    (profile.generation.recovery.patience, profile.generation.recovery.insist) = (3.0, true);
    let ahead = LaserModel::default();
    let around = ahead.all_round();
    for seed in 1..=3 {
        for (v_reverse, laser, gets_out) in [(0.0, around, false), (0.2, ahead, false), (0.2, around, true)] {
            let seconds = seconds_to_leave(&profile, &robot(v_reverse), laser, seed);
            assert_eq!(seconds.is_some(), gets_out, "seed {seed}, {v_reverse} m/s, {laser:?}: {seconds:?}");
        }
    }
}
