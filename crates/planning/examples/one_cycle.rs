//! One planning cycle: from a map, a belief and a person to the trajectory that the robot is to drive.
//!
//! `cargo run --release -p curionav-planning --example one_cycle`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use std::sync::Arc;

use curionav_planning::arbitration::{Context, Observer, Scores, arbitrate};
use curionav_planning::generation::{self, GenerationInput};
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::nalgebra::Matrix3;
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::profile::Profile;
use curionav_planning::scene::{Belief, People};
use curionav_planning::terms::{self, DerivedFields, Task};

/// A hall of 20 m by 12 m, walled in, with a wall across it that leaves a gap at the top. Cells of 0.1 m.
fn hall() -> Result<StaticMap, Box<dyn std::error::Error>> {
    let solid = |c: usize, r: usize| c == 0 || r == 0 || c == 199 || r == 119 || (c == 100 && r < 80);
    let cells = (0..200 * 120).map(|i| if solid(i % 200, i / 200) { 100 } else { 0 }).collect();
    Ok(StaticMap::new(OccupancyGrid::new(200, 120, 0.1, Pose2::default(), cells)?))
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    // What stays the same during a mission.
    let map = Arc::new(hall()?);
    let profile = Profile::default();
    let task = Task { goal: Point2::new(17.0, 3.0), ..Task::default() };
    let geodesic = map.geodesic(task.goal, task.robot.radius())?;
    let generator = generation::find(&profile.generator).ok_or("no such generator")?;

    // What is known now: the robot moves along the wall, a person comes towards it.
    let belief = Belief {
        pose: Pose2::new(3.0, 3.0, 0.6),
        covariance: Matrix3::from_diagonal_element(0.01),
        twist: Twist { v: 0.5, omega: 0.0 },
    };
    let people = People {
        id: vec![1],
        x: vec![6.0],
        y: vec![5.0],
        vx: vec![-0.8],
        vy: vec![-0.4],
        ..Default::default()
    };
    let scene = Observer::default().form_scene(&profile, &task.robot, (0, 0.0), belief, &people);

    // Generate.
    let input = GenerationInput {
        params: &profile.generator_part(),
        map: &map,
        goal: task.goal,
        geodesic: &geodesic,
        information: None,
        robot: &task.robot,
        scene: &scene,
        previous: None,
        seed: 1,
    };
    let (generated, _) = generator.generate(&input, None, &|| 0.0);
    let candidates = generated.candidates;

    // Evaluate.
    let mut scores = Scores::new(candidates.len());
    for (term, _) in profile.active_terms(scene.uncertain) {
        let evaluator = terms::evaluator(term, &profile, &task, &map)?;
        scores.insert(term, 0, &evaluator.evaluate(&scene, &candidates, &|| false)?)?;
    }

    // Decide.
    let context = Context {
        profile: &profile,
        scene: &scene,
        map: &map,
        robot: &task.robot,
        goal: task.goal,
        candidates: &candidates,
        previous: None,
    };
    let verdict = arbitrate(&context, &scores);
    let index = verdict.chosen.ok_or("nothing can be followed")?;
    println!(
        "{} candidates; number {index} is taken because: {:?}",
        candidates.len(),
        verdict.decision.reason
    );
    for term in &verdict.totals.terms {
        println!("  {:<9} {:>6.3}", term.term, term.cost[index].ok_or("not scored")?);
    }
    println!("   after   x     y   speed");
    let trajectory = &verdict.decision.trajectory;
    for k in (0..trajectory.len()).step_by(3) {
        let (pose, twist) = trajectory.states().at(k);
        let time = (k + 1) as f64 * trajectory.dt();
        println!("  {time:>4.1} s {:>5.2} {:>5.2} {:>5.2} m/s", pose.x, pose.y, twist.v);
    }
    Ok(())
}

#[test]
fn it_ends_in_a_trajectory() {
    main().unwrap();
}
