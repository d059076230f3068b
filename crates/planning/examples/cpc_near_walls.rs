//! Curiosity at work: the same uncertain robot drives along a wall and across the void, and CPC (eq. 15) tells how
//! uncertain it would become on the way.
//!
//! `cargo run --release -p curionav-planning --example cpc_near_walls`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use std::sync::Arc;

use curionav_planning::candidates::CandidateSet;
use curionav_planning::evaluation::Evaluator;
use curionav_planning::evaluation::cpc::{CpcEvaluator, CpcParams, InformationParams};
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::{OdometryNoise, step};
use curionav_planning::nalgebra::Matrix3;
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::scene::{Belief, People, Scene};
use curionav_planning::sensor::LaserModel;
use curionav_planning::states::States;
use curionav_planning::terms::DerivedFields;

const STEPS: usize = 13;
const DT: f64 = 0.3;

/// Straight ahead from `start` at 1 m/s.
fn straight(start: Pose2) -> Result<CandidateSet, Box<dyn std::error::Error>> {
    let (twist, mut pose, mut states) = (Twist { v: 1.0, omega: 0.0 }, start, States::default());
    for _ in 0..STEPS {
        pose = step(pose, twist, DT);
        states.push(pose, twist);
    }
    Ok(CandidateSet::new(STEPS, DT, vec![0], states)?)
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A square of 40 m by 40 m, empty but for a wall with a niche every 3 m along its lower edge.
    let solid = |c: usize, r: usize| r < if c % 30 < 10 { 10 } else { 20 };
    let cells = (0..400 * 400).map(|i| if solid(i % 400, i / 400) { 100 } else { 0 }).collect();
    let map = Arc::new(StaticMap::new(OccupancyGrid::new(400, 400, 0.1, Pose2::default(), cells)?));
    let information = map.information(LaserModel::default(), &InformationParams::default())?;
    let evaluator = CpcEvaluator::new(information, OdometryNoise::default(), CpcParams::default());

    let mut costs = Vec::new();
    for y in [3.0, 5.0, 20.0] {
        let start = Pose2::new(15.0, y, 0.0);
        let covariance = Matrix3::from_diagonal(&[0.15, 0.15, 0.02].into());
        let belief = Belief { pose: start, covariance, twist: Twist { v: 1.0, omega: 0.0 } };
        let scene = Scene { uncertain: true, ..Scene::new(belief, People::default()) };
        let cost = evaluator.evaluate(&scene, &straight(start)?, &|| false)?[0];
        println!("{:>4.1} m from the wall: zeta = {cost:.3}, {:.3} per state", y - 2.0, cost / STEPS as f64);
        costs.push(cost);
    }
    if !costs.is_sorted_by(|a, b| a < b) {
        return Err("the farther from the wall, the less is seen and the more it should cost".into());
    }
    Ok(())
}

#[test]
fn the_farther_from_the_wall_the_more_it_costs() {
    main().unwrap();
}
