//! Claims about whole planning cycles, and the worlds they are made in.
mod backing;
mod bi_risk_rrt;
mod commanded;
mod drive;
mod dwa;
mod risk_rrt;
mod rrt_star;
mod update;
mod way_past;
mod zones;

use std::collections::BTreeSet;

use nalgebra::Matrix3;

use super::*;
use crate::candidates::CandidateSet;
use crate::collision::{CollisionChecker, CollisionParams};
use crate::forecast::ForecastParams;
use crate::geometry::{Point2, Pose2, Twist, wrap_angle};
use crate::motion::{RobotModel, step};
use crate::occupancy::{GeodesicField, OccupancyGrid, StaticMap};
use crate::profile::Profile;
use crate::random::{rng, uniform};
use crate::scene::{Belief, People, Scene};

/// 30 m x 30 m of 0.1 m cells with walls around it and `boxes` (x0, y0, x1, y1) inside, metres.
pub(super) fn hall(boxes: &[(f64, f64, f64, f64)]) -> StaticMap {
    let inside = |x: f64, y: f64| {
        boxes.iter().any(|b| x >= b.0 && x < b.2 && y >= b.1 && y < b.3)
            || x < 0.2
            || y < 0.2
            || x >= 29.8
            || y >= 29.8
    };
    let cells = (0..90_000)
        .map(|i| {
            let x = 0.1 * f64::from(i % 300) + 0.05;
            let y = 0.1 * f64::from(i / 300) + 0.05;
            if inside(x, y) { 100 } else { 0 }
        })
        .collect();
    StaticMap::new(OccupancyGrid::new(300, 300, 0.1, Pose2::default(), cells).unwrap())
}

/// A wall across the hall with a gap, and pillars.
pub(super) fn furnished() -> StaticMap {
    hall(&[
        (0.0, 14.0, 11.0, 14.6),
        (13.5, 14.0, 24.0, 14.6),
        (6.0, 6.0, 8.0, 8.0),
        (16.0, 4.0, 17.0, 10.0),
        (18.0, 19.0, 20.0, 21.0),
        (9.0, 20.0, 10.5, 24.0),
        (24.0, 22.0, 26.0, 23.0),
    ])
}

fn scene(tick: u64, pose: Pose2, twist: Twist, people: &People) -> Scene {
    let near = |i: &usize| people.position(*i).distance(pose.position()) <= 9.5;
    let people = people.pick((0..people.len()).filter(near));
    let belief = Belief { pose, covariance: Matrix3::identity() * 0.0025, twist };
    Scene { tick, stamp: 0.1 * tick as f64, ..Scene::new(belief, people) }
}

/// A generator with its parameters.
struct Generator {
    kind: &'static GeneratorKind,
    params: GeneratorPart,
}

impl Generator {
    fn new(name: &str, params: GeneratorPart) -> Self {
        Self { kind: find(name).unwrap(), params }
    }

    fn rrt_star() -> Self {
        Self::new("rrt-star", Profile::default().generator_part())
    }

    fn generate(
        &self,
        input: &GenerationInput<'_>,
        tree: Option<Tree>,
        seed: u64,
        spent: &dyn Fn() -> f64,
    ) -> Generated {
        let input = GenerationInput { params: &self.params, seed, ..*input };
        self.kind.generate(&input, tree, spent).0
    }
}

#[test]
fn every_generator_grows_as_it_is_told() {
    for kind in GENERATORS {
        let mut params = GenerationParams::default();
        *(kind.iterations)(&mut params) = 17;
        assert_ne!(params, GenerationParams::default(), "{}", kind.name);
    }
}

struct World {
    map: StaticMap,
    goal: Point2,
    geodesic: GeodesicField,
    robot: RobotModel,
    params: GeneratorPart,
}

impl World {
    fn new(map: StaticMap, goal: Point2) -> Self {
        let geodesic = GeodesicField::new(&map, goal, 0.45);
        Self {
            map,
            goal,
            geodesic,
            robot: RobotModel::default(),
            params: Profile::default().generator_part(),
        }
    }

    fn input<'a>(&'a self, scene: &'a Scene, previous: Option<&'a [Pose2]>) -> GenerationInput<'a> {
        GenerationInput {
            map: &self.map,
            goal: self.goal,
            geodesic: &self.geodesic,
            information: None,
            robot: &self.robot,
            scene,
            previous,
            params: &self.params,
            seed: 0,
        }
    }
}

/// How many candidates are 0.1 m or 0.15 rad away from every other counted one somewhere in the first 2 s.
/// From rest, half a disc of 0.9 m is all that can be reached by then.
fn differing(set: &CandidateSet) -> usize {
    let states = (2.0 / set.dt()) as usize;
    let mut kept: Vec<usize> = Vec::new();
    for i in 0..set.len() {
        let gap = |j: usize| {
            (0..states)
                .map(|k| {
                    let a = set.range(i).start + k;
                    let b = set.range(j).start + k;
                    let turned = wrap_angle(set.all_states().heading[a] - set.all_states().heading[b]).abs();
                    set.all_states().position(a).distance(set.all_states().position(b)).max(turned / 1.5)
                })
                .fold(0.0, f64::max)
        };
        if kept.iter().all(|&j| gap(j) > 0.1) {
            kept.push(i);
        }
    }
    kept.len()
}

fn crowd(seed: u64) -> People {
    let mut r = rng(seed, 5);
    let mut people = People { radius: 0.3, ..People::default() };
    for id in 0..10 {
        let distance = 3.0 + 6.0 * uniform(&mut r);
        let angle = std::f64::consts::TAU * uniform(&mut r);
        let (s, c) = crate::numerics::sin_cos(angle);
        people.id.push(id);
        people.x.push(12.0 + distance * c);
        people.y.push(6.5 + distance * s);
        people.vx.push(1.4 * uniform(&mut r) - 0.7);
        people.vy.push(1.4 * uniform(&mut r) - 0.7);
    }
    people
}

/// Scenes worth checking: open and furnished, alone and in company, standing, moving and turning.
fn various() -> Vec<(World, Scene)> {
    let mut all = Vec::new();
    for (k, twist) in [(0.0, 0.0), (0.9, 0.0), (0.5, 0.8), (1.0, -0.4)].into_iter().enumerate() {
        for people in [People { radius: 0.3, ..People::default() }, crowd(k as u64)] {
            for map in [hall(&[]), furnished()] {
                let world = World::new(map, Point2::new(14.0, 26.0));
                let pose = Pose2::new(12.0, 8.0 - 3.0 * f64::from(k as u32 % 2), 1.2 * k as f64);
                let twist = Twist { v: twist.0, omega: twist.1 };
                all.push((world, scene(3 * k as u64, pose, twist, &people)));
            }
        }
    }
    all
}

/// That every candidate keeps the robot's limits, ends standing and is free.
fn drivable_and_free(world: &World, scene: &Scene, set: &CandidateSet) {
    let checker = world.input(scene, None).checker();
    assert_eq!((set.steps(), set.dt()), (13, 0.3));
    assert!(set.len() <= 100);
    for i in 0..set.len() {
        assert_eq!(set.id()[i], i as u32);
        let mut pose = scene.belief.pose;
        let mut twist = scene.belief.twist;
        for k in set.range(i) {
            let v = set.all_states().v[k];
            let omega = set.all_states().omega[k];
            assert!((0.0..=1.0).contains(&v) && omega.abs() <= 1.0);
            assert!((v - twist.v).abs() <= 0.5 * 0.3 + 1e-9);
            assert!((omega - twist.omega).abs() <= 1.0 * 0.3 + 1e-9);
            let next = set.all_states().pose(k);
            assert!(pose.position().distance(next.position()) <= 0.3 + 1e-9);
            (pose, twist) = (next, Twist { v, omega });
        }
        assert!(twist.v < 0.02 && twist.omega.abs() < 0.02, "{twist:?}");
        assert_eq!(checker.first_collision(&set.states(i), 0.3), None);
    }
}

#[test]
fn every_candidate_can_be_driven_ends_standing_and_is_free() {
    for (world, scene) in various() {
        let generator = Generator::rrt_star();
        let set = generator.generate(&world.input(&scene, None), None, 1, &|| 0.0).candidates;
        drivable_and_free(&world, &scene, &set);
    }
}

#[test]
fn there_is_a_choice_within_two_seconds_in_the_open_and_among_ten_people() {
    for (k, (world, scene)) in various().iter().enumerate() {
        let generator = Generator::rrt_star();
        let set = generator.generate(&world.input(scene, None), None, 1, &|| 0.0).candidates;
        println!(
            "scene {k}: {} people, {} candidates, {} differ",
            scene.people.len(),
            set.len(),
            differing(&set)
        );
        assert!(differing(&set) >= 20, "scene {k}: {} of {} differ", differing(&set), set.len());
    }
}

#[test]
fn the_same_seed_and_tree_give_the_same_answer() {
    let world = World::new(furnished(), Point2::new(14.0, 26.0));
    let people = crowd(3);
    let generator = Generator::rrt_star();
    let run = |seed: u64| {
        let mut tree = None;
        let mut answers = Vec::new();
        for k in 0..4 {
            let pose = Pose2::new(15.0, 7.0 + 0.3 * k as f64, 1.5);
            let scene = scene(3 * k, pose, Twist { v: 0.8, omega: 0.0 }, &people);
            let answer = generator.generate(&world.input(&scene, None), tree, seed, &|| 0.0);
            assert!(answer.tree.is_sound());
            tree = Some(answer.tree.clone());
            answers.push(answer);
        }
        answers
    };
    assert_eq!(run(5), run(5));
    assert_ne!(run(5), run(6));
}

#[test]
fn a_broken_tree_from_outside_is_replaced() {
    let world = World::new(furnished(), Point2::new(14.0, 26.0));
    let scene = scene(0, Pose2::new(15.0, 3.0, 1.5), Twist::default(), &crowd(1));
    let generator = Generator::rrt_star();
    let fresh = generator.generate(&world.input(&scene, None), None, 1, &|| 0.0);
    let broken = Tree { parent: vec![7; 3], ..fresh.tree.clone() };
    assert_eq!(generator.generate(&world.input(&scene, None), Some(broken), 1, &|| 0.0), fresh);
}

#[test]
fn a_way_that_lies_behind_can_be_turned_to_on_the_spot() {
    let world = World::new(hall(&[]), Point2::new(15.0, 25.0));
    let people = People { radius: 0.3, ..People::default() };
    let scene = scene(0, Pose2::new(15.0, 8.0, -1.5), Twist::default(), &people);
    let set = Generator::rrt_star().generate(&world.input(&scene, None), None, 1, &|| 0.0).candidates;
    let turning = (0..set.len()).filter(|&i| {
        let r = set.range(i);
        (set.all_states().x[r.end - 8] - 15.0).abs() < 0.1 && (set.end(i).heading + 1.5).abs() > 0.8
    });
    assert!(turning.count() >= 1);
}

#[test]
fn cells_of_candidates_cover_many_directions() {
    let world = World::new(hall(&[]), Point2::new(15.0, 25.0));
    let people = People { radius: 0.3, ..People::default() };
    let scene = scene(0, Pose2::new(15.0, 15.0, 1.57), Twist { v: 0.5, omega: 0.0 }, &people);
    let set = Generator::rrt_star().generate(&world.input(&scene, None), None, 1, &|| 0.0).candidates;
    let sectors: BTreeSet<i64> = (0..set.len())
        .map(|i| {
            let end = set.end(i).position();
            (crate::geometry::bearing(Point2::new(15.0, 15.0), end) / 0.5).floor() as i64
        })
        .collect();
    // 0.5 rad sectors: more than the front quarter to either side
    assert!(sectors.len() >= 5, "{sectors:?}");
}

#[test]
fn where_not_all_can_be_offered_no_direction_is_left_out() {
    let mut world = World::new(hall(&[]), Point2::new(15.0, 25.0));
    let people = People { radius: 0.3, ..People::default() };
    let from = Point2::new(15.0, 15.0);
    let scene = scene(0, Pose2::new(from.x, from.y, 1.57), Twist { v: 0.5, omega: 0.0 }, &people);
    let mut directions = |max_candidates: u32| -> BTreeSet<usize> {
        world.params.generation.candidates.max_candidates = max_candidates;
        let generator = Generator::new("rrt-star", world.params.clone());
        let set = generator.generate(&world.input(&scene, None), None, 1, &|| 0.0).candidates;
        assert!(set.len() <= max_candidates as usize);
        let end = |i: usize| set.end(i).position();
        (0..set.len()).map(|i| branches::sector(from, end(i))).collect()
    };
    let all = directions(512);
    assert!(all.len() >= 5, "{all:?}");
    assert_eq!(directions(20), all);
}

#[test]
fn without_a_tree_only_what_is_added_is_offered_and_each_addition_can_be_switched_off() {
    let mut world = World::new(hall(&[]), Point2::new(15.0, 25.0));
    let people = People { radius: 0.3, ..People::default() };
    let scene = scene(0, Pose2::new(15.0, 15.0, 1.57), Twist { v: 0.5, omega: 0.0 }, &people);
    let ahead: Vec<Pose2> = (1..=8).map(|k| Pose2::new(15.0, 15.0 + 0.3 * f64::from(k), 1.57)).collect();
    let mut offered = |besides: Besides| {
        world.params.generation.candidates.besides = besides;
        let generator = Generator::new("rrt-star", world.params.clone());
        // The time is over before anything grows.
        generator.generate(&world.input(&scene, Some(&ahead)), None, 1, &|| 1.0).candidates.len()
    };
    let none = Besides { previous: false, shortest_way: false, arcs: false, fan: false };
    assert_eq!(offered(none), 0);
    assert!(offered(Besides { previous: true, ..none }) > 0);
    assert!(offered(Besides { shortest_way: true, ..none }) > 0);
    assert!(offered(Besides { arcs: true, ..none }) >= 13);
}
