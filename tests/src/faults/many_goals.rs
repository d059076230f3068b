//! A pool for more goals than one generator has room for.

use std::collections::BTreeMap;
use std::time::Duration;

use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::GeodesicField;
use curionav_pool::context::PlanContext;
use curionav_pool::generator;
use curionav_pool::replicas::{Probe, Replicas, Wanted};
use curionav_runtime::fields::Fields;
use curionav_schemas::{Clock, GenerateRequest, Message, Refusal, Scene, keys};
use curionav_testing::golden;

use super::corridor_map;

const ROBOTS: usize = 100;
const GENERATORS: usize = 4;
/// Ways to goals that a generator has room for.
const ROOM: usize = 70;
const CYCLES: usize = 8;

/// What one robot asks: to be prepared for, and to be planned for.
struct Robot {
    name: String,
    warm_up: GenerateRequest,
    cycle: GenerateRequest,
}

fn robots() -> Vec<Robot> {
    let (fields, map) = corridor_map::fields();
    (0..ROBOTS)
        .map(|i| {
            let mut mission = corridor_map::mission(map, 1000 + i as u64, Clock::Realtime, 1);
            // Each to another cell at the far end of the corridor.
            mission.order.goal_x = 20.1 + 0.2 * (i % 20) as f64;
            mission.order.goal_y = 3.1 + 0.2 * (i / 20) as f64;
            let context = PlanContext::new(mission, &fields, true).unwrap();
            // The way past obstacles is derived in each cycle: with them no generator would be cold.
            let scene = Scene { uncertain: false, obstacles: Default::default(), ..golden::scene() };
            let request = |bytes: Vec<u8>| GenerateRequest::decode(&bytes, None).unwrap();
            let warm_up = request(context.warm_up_generator().encode(1000));
            let cycle = request(context.generate_question((1, 1), &scene, 0, None, &[]).encode(1000));
            Robot { name: format!("robot-{i}"), warm_up, cycle }
        })
        .collect()
}

fn pool() -> BTreeMap<String, Fields> {
    let (fields, map) = corridor_map::fields();
    let map = fields.map(map).unwrap();
    let bytes = ROOM * GeodesicField::new(&map, Point2::new(20.1, 3.1), 0.45).bytes();
    let generator = |i| (format!("generator-{i}"), Fields::of_maps_within([(*map).clone()], bytes));
    (0..GENERATORS).map(generator).collect()
}

/// A generator's answer: whether it is one, or refused as cold.
fn answers(fields: &Fields, request: &GenerateRequest) -> bool {
    match generator::answer("a", fields, request.clone(), &|| Duration::ZERO) {
        Ok(_) => true,
        Err(reject) if matches!(reject.why, Refusal::Cold { .. }) => false,
        Err(reject) => panic!("{reject}"),
    }
}

/// Lets every robot ask the generator that `choose` names by robot and cycle, once those that `keeps` names for a robot
/// have prepared for it; gives the share of answers.
fn share<'a>(
    robots: &[Robot],
    keeps: impl Fn(usize) -> Vec<&'a String>,
    choose: impl Fn(usize, usize) -> &'a String,
) -> f64 {
    let pool = pool();
    for (i, robot) in robots.iter().enumerate() {
        keeps(i).into_iter().for_each(|name| assert!(answers(&pool[name], &robot.warm_up)));
    }
    let mut answered = 0;
    for cycle in 0..CYCLES {
        for (i, robot) in robots.iter().enumerate() {
            let fields = &pool[choose(i, cycle)];
            if answers(&fields.kept(), &robot.cycle) {
                answered += 1;
            } else {
                // As the probe that follows such an answer.
                assert!(answers(fields, &robot.warm_up));
            }
        }
    }
    f64::from(answered) / (CYCLES * robots.len()) as f64
}

#[test]
fn a_pool_answers_a_hundred_goals_though_no_generator_has_room_for_all() {
    let (robots, names): (Vec<Robot>, Vec<String>) = (robots(), pool().into_keys().collect());
    let kept: Vec<Vec<String>> = (robots.iter())
        .map(|robot| {
            let mut replicas = Replicas::default();
            let wanted = Wanted { robot: &robot.name, count: 2 };
            replicas.update(keys::GENERATOR, &names, wanted, Duration::ZERO);
            for Probe { role, instance } in replicas.take_due(Duration::ZERO) {
                replicas.probed(&role, &instance, Some(1), Duration::ZERO);
            }
            replicas.preferred(keys::GENERATOR)
        })
        .collect();
    let goals_of = |name: &String| kept.iter().filter(|of| of.contains(name)).count();
    let goals: Vec<usize> = names.iter().map(goals_of).collect();
    let own = share(&robots, |i| kept[i].iter().collect(), |i, _| &kept[i][0]);
    // If each asked every generator in turn, and so each had to prepare for all goals.
    let in_turn = share(&robots, |_| names.iter().collect(), |i, cycle| &names[(i + cycle) % GENERATORS]);
    println!(
        "{ROBOTS} goals, {GENERATORS} generators with room for {ROOM}: {:.1} % answered; goals per generator {goals:?}. \
         In turn it would be {:.1} %.",
        1e2 * own,
        1e2 * in_turn
    );
    assert!(own == 1.0 && in_turn < 0.5);
}
