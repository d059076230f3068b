//! A trajectory generator of one's own: a fan of arcs, those that run into something left out.
//!
//! `cargo run --release -p curionav-planning --example own_generator`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use std::sync::Arc;

use curionav_planning::candidates::CandidateSet;
use curionav_planning::generation::{Generated, GenerationInput, GeneratorKind, Pace, Tree};
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::step;
use curionav_planning::nalgebra::Matrix3;
use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_planning::profile::Profile;
use curionav_planning::scene::{Belief, People, Scene};
use curionav_planning::states::States;
use curionav_planning::terms::{DerivedFields, Task};

/// How many arcs there are.
const ARCS: u32 = 21;

/// Entered into the registry, `crates/planning/src/generation/registry.rs`, profiles can name it.
const FAN: GeneratorKind =
    GeneratorKind { name: "fan", tables: &[], iterations: |params| &mut params.tree.iterations, grow: fan };

/// Arcs of equal speed, turning from full left to full right.
fn fan(input: &GenerationInput<'_>, _tree: Option<Tree>, pace: &Pace<'_>) -> Generated {
    let (steps, dt) = (input.params.steps, input.params.dt);
    let checker = input.checker();
    let (mut states, mut count) = (States::default(), 0);
    for arc in (0..ARCS).take_while(|_| !pace.is_over(1.0)) {
        let share = 2.0 * f64::from(arc) / f64::from(ARCS - 1) - 1.0;
        let wanted = Twist { v: input.robot.v_max, omega: share * input.robot.omega_max };
        let (mut pose, mut twist) = input.scene.belief.motion();
        let mut driven = States::default();
        for _ in 0..steps {
            twist = input.robot.limit(twist, wanted, dt);
            pose = step(pose, twist, dt);
            driven.push(pose, twist);
        }
        if checker.first_collision(&driven, dt).is_none() {
            states.append(driven);
            count += 1;
        }
    }
    let candidates = CandidateSet::new(steps, dt, (0..count).collect(), states)
        .unwrap_or_else(|_| CandidateSet::empty(steps, dt));
    // Nothing lasts from one cycle to the next.
    Generated { candidates, tree: Tree::default() }
}
fn main() -> Result<(), Box<dyn std::error::Error>> {
    // A room of 8 m by 8 m with a pillar ahead of the robot.
    let solid = |c: i32, r: i32| (c - 45).pow(2) + (r - 40).pow(2) < 25;
    let cells = (0..80 * 80).map(|i| if solid(i % 80, i / 80) { 100 } else { 0 }).collect();
    let map = Arc::new(StaticMap::new(OccupancyGrid::new(80, 80, 0.1, Pose2::default(), cells)?));
    let belief = Belief {
        pose: Pose2::new(2.0, 4.0, 0.0),
        covariance: Matrix3::from_diagonal_element(0.01),
        twist: Twist::default(),
    };
    let scene = Scene::new(belief, People::default());
    let (profile, task) = (Profile::default(), Task { goal: Point2::new(7.0, 4.0), ..Task::default() });
    let input = GenerationInput {
        params: &profile.generator_part(),
        map: &map,
        goal: task.goal,
        geodesic: &*map.geodesic(task.goal, task.robot.radius())?,
        information: None,
        robot: &task.robot,
        scene: &scene,
        previous: None,
        seed: 0,
    };
    let candidates = FAN.generate(&input, None, &|| 0.0).0.candidates;
    println!("{} of {ARCS} arcs are free; they end at", candidates.len());
    for i in 0..candidates.len() {
        let end = candidates.end(i);
        println!("  ({:.2}, {:.2})", end.x, end.y);
    }
    if candidates.is_empty() || candidates.len() == ARCS as usize {
        return Err("the pillar should be in the way of some arcs".into());
    }
    Ok(())
}

#[test]
fn the_pillar_is_in_the_way_of_some_arcs() {
    main().unwrap();
}
