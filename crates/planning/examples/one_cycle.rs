//! One planning cycle: from a map, a belief and a person to the trajectory that the robot is to drive.
//!
//! `cargo run --release -p curionav-planning --example one_cycle`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use std::sync::Arc;

use curionav_planning::Planner;
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::RobotModel;
use curionav_planning::nalgebra::Matrix3;
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::profile::Profile;
use curionav_planning::scene::{Belief, People};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A hall of 20 m by 12 m with a wall across it that leaves a gap at the top. Cells of 0.1 m.
    let cells = (0..200 * 120).map(|i| if i % 200 == 100 && i / 200 < 80 { 100 } else { 0 }).collect();
    let map = Arc::new(StaticMap::new(OccupancyGrid::new(200, 120, 0.1, Pose2::default(), cells)?));
    let mut planner = Planner::new(map, Profile::default(), RobotModel::default())?;
    planner.set_goal(Point2::new(17.0, 3.0))?;

    // The robot moves along the wall, a person comes towards it.
    let pose = Pose2::new(3.0, 3.0, 0.6);
    let twist = Twist { v: 0.5, omega: 0.0 };
    let belief = Belief { pose, covariance: Matrix3::from_diagonal_element(0.01), twist };
    let people = People::walking(0.25, &[[6.0, 5.0, -0.8, -0.4]]);
    let verdict = planner.cycle(belief, &people, 0.0)?;
    println!("{:?} because {:?}", verdict.decision.action, verdict.decision.reason);
    let states = verdict.decision.trajectory.states();
    for k in 0..states.len() {
        println!("  {:>5.2} m {:>5.2} m {:>5.2} m/s", states.x[k], states.y[k], states.v[k]);
    }
    verdict.chosen.map(|_| ()).ok_or_else(|| "nothing can be followed".into())
}

#[test]
fn it_ends_in_a_trajectory() {
    main().unwrap();
}
