//! Claims about whole planning cycles.

use std::collections::BTreeSet;

use nalgebra::Matrix3;

use super::*;
use crate::geometry::{Point2, Twist, wrap_angle};
use crate::motion::step;
use crate::occupancy::OccupancyGrid;
use crate::random::uniform;
use crate::scene::{Belief, People};
use crate::tracking::{Reference, TrackingParams, track};

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
            let (x, y) = (0.1 * f64::from(i % 300) + 0.05, 0.1 * f64::from(i / 300) + 0.05);
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

/// People who walk to and fro, and wait when the robot stands in their way.
struct Walkers {
    people: People,
    velocity: Vec<(f64, f64)>,
    ends: Vec<(Point2, Point2)>,
}

impl Walkers {
    fn random(count: u32, map: &StaticMap, keep_away: &[Point2], seed: u64) -> Self {
        let mut r = rng(seed, 77);
        let mut w = Self {
            people: People { radius: 0.3, ..People::default() },
            velocity: Vec::new(),
            ends: Vec::new(),
        };
        while (w.ends.len() as u32) < count {
            let mut draw = || Point2::new(1.0 + 28.0 * uniform(&mut r), 1.0 + 28.0 * uniform(&mut r));
            let (a, b) = (draw(), draw());
            let speed = 0.3 + 0.7 * uniform(&mut r);
            let length = a.distance(b);
            let clear = (0..=100).all(|k| {
                let s = f64::from(k) / 100.0;
                let p = Point2::new(a.x + s * (b.x - a.x), a.y + s * (b.y - a.y));
                map.to_obstacle.at(&map.grid, p) > 0.4 && keep_away.iter().all(|q| q.distance(p) > 2.5)
            });
            if !clear || !(4.0..14.0).contains(&length) {
                continue;
            }
            w.people.id.push(w.ends.len() as u32);
            w.people.x.push(a.x);
            w.people.y.push(a.y);
            let velocity = (speed * (b.x - a.x) / length, speed * (b.y - a.y) / length);
            w.people.vx.push(velocity.0);
            w.people.vy.push(velocity.1);
            w.velocity.push(velocity);
            w.ends.push((a, b));
        }
        w
    }

    fn walk(&mut self, dt: f64, robot: Point2, contact: f64) {
        for i in 0..self.people.len() {
            let p = self.people.position(i);
            let (vx, vy) = self.velocity[i];
            let next = Point2::new(p.x + vx * dt, p.y + vy * dt);
            if next.distance(robot) < contact + 0.02 && next.distance(robot) < p.distance(robot) {
                (self.people.vx[i], self.people.vy[i]) = (0.0, 0.0);
                continue;
            }
            (self.people.vx[i], self.people.vy[i]) = (vx, vy);
            (self.people.x[i], self.people.y[i]) = (next.x, next.y);
            let (a, b) = self.ends[i];
            if (next.x - b.x) * vx + (next.y - b.y) * vy > 0.0 {
                self.velocity[i] = (-vx, -vy);
                (self.people.vx[i], self.people.vy[i]) = self.velocity[i];
                self.ends[i] = (b, a);
            }
        }
    }
}

fn scene(tick: u64, pose: Pose2, twist: Twist, people: &People) -> Scene {
    Scene {
        tick,
        stamp: 0.1 * tick as f64,
        belief: Belief { pose, covariance: Matrix3::identity() * 0.0025, twist },
        people: people.within(pose.position(), 9.5),
        uncertain: false,
    }
}

struct World {
    map: StaticMap,
    geodesic: GeodesicField,
    robot: RobotModel,
}

impl World {
    fn new(map: StaticMap, goal: Point2) -> Self {
        let geodesic = GeodesicField::new(&map.grid, &map.to_obstacle, goal, 0.45);
        Self { map, geodesic, robot: RobotModel::default() }
    }

    fn input<'a>(&'a self, scene: &'a Scene, previous: Option<&'a [Pose2]>) -> GenerationInput<'a> {
        GenerationInput {
            map: &self.map,
            geodesic: &self.geodesic,
            robot: &self.robot,
            scene,
            forecast: ForecastParams::default(),
            previous,
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
                    let (a, b) = (set.range(i).start + k, set.range(j).start + k);
                    let turned = wrap_angle(set.heading()[a] - set.heading()[b]).abs();
                    Point2::new(set.x()[a], set.y()[a])
                        .distance(Point2::new(set.x()[b], set.y()[b]))
                        .max(turned / 1.5)
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
        let (distance, angle) = (1.5 + 4.0 * uniform(&mut r), std::f64::consts::TAU * uniform(&mut r));
        let (s, c) = crate::numerics::sin_cos(angle);
        people.id.push(id);
        people.x.push(15.0 + distance * c);
        people.y.push(7.0 + distance * s);
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
                let pose = Pose2::new(15.0, 7.0 - 4.5 * f64::from(k as u32 % 2), 1.2 * k as f64);
                let twist = Twist { v: twist.0, omega: twist.1 };
                all.push((world, scene(3 * k as u64, pose, twist, &people)));
            }
        }
    }
    all
}

#[test]
fn every_candidate_can_be_driven_ends_standing_and_is_free() {
    for (world, scene) in various() {
        let generator = RrtStarGenerator::default();
        let set = generator.generate(&world.input(&scene, None), None, 1, &|| false).candidates;
        let checker = CollisionChecker::new(
            &world.map,
            &world.robot,
            &scene,
            ForecastParams::default(),
            &CollisionParams::default(),
        );
        assert_eq!((set.steps(), set.dt()), (13, 0.3));
        assert!(set.len() <= 100);
        for i in 0..set.len() {
            assert_eq!(set.id()[i], i as u32);
            let (mut pose, mut twist) = (scene.belief.pose, scene.belief.twist);
            for k in set.range(i) {
                let (v, omega) = (set.v()[k], set.omega()[k]);
                assert!((0.0..=1.0).contains(&v) && omega.abs() <= 1.0);
                assert!((v - twist.v).abs() <= 0.5 * 0.3 + 1e-9);
                assert!((omega - twist.omega).abs() <= 1.0 * 0.3 + 1e-9);
                let next = Pose2::new(set.x()[k], set.y()[k], set.heading()[k]);
                assert!(pose.position().distance(next.position()) <= 0.3 + 1e-9);
                (pose, twist) = (next, Twist { v, omega });
            }
            assert!(twist.v < 0.02 && twist.omega.abs() < 0.02, "{twist:?}");
            let r = set.range(i);
            assert_eq!(
                checker.first_collision(&set.x()[r.clone()], &set.y()[r.clone()], &set.heading()[r], 0.3),
                None
            );
        }
    }
}

#[test]
fn there_is_a_choice_within_two_seconds_in_the_open_and_among_ten_people() {
    for (k, (world, scene)) in various().iter().enumerate() {
        let generator = RrtStarGenerator::default();
        let set = generator.generate(&world.input(scene, None), None, 1, &|| false).candidates;
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
    let generator = RrtStarGenerator::default();
    let run = |seed: u64| {
        let mut tree = None;
        let mut answers = Vec::new();
        for k in 0..4 {
            let pose = Pose2::new(15.0, 7.0 + 0.3 * k as f64, 1.5);
            let scene = scene(3 * k, pose, Twist { v: 0.8, omega: 0.0 }, &people);
            let answer = generator.generate(&world.input(&scene, None), tree, seed, &|| false);
            assert_eq!(answer.tree.check(), Ok(()));
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
    let generator = RrtStarGenerator::default();
    let fresh = generator.generate(&world.input(&scene, None), None, 1, &|| false);
    let broken = Tree { parent: vec![7; 3], ..Tree::default() };
    assert_eq!(generator.generate(&world.input(&scene, None), Some(broken), 1, &|| false), fresh);
}

#[test]
fn a_way_that_lies_behind_can_be_turned_to_on_the_spot() {
    let world = World::new(hall(&[]), Point2::new(15.0, 25.0));
    let people = People { radius: 0.3, ..People::default() };
    let scene = scene(0, Pose2::new(15.0, 8.0, -1.5), Twist::default(), &people);
    let set = RrtStarGenerator::default().generate(&world.input(&scene, None), None, 1, &|| false).candidates;
    let turning = (0..set.len()).filter(|&i| {
        let r = set.range(i);
        (set.x()[r.end - 8] - 15.0).abs() < 0.1 && (set.heading()[r.end - 1] + 1.5).abs() > 0.8
    });
    assert!(turning.count() >= 1);
}

struct Drive {
    reached: bool,
    contacts: u32,
    seconds: f64,
    stops: u32,
    length: f64,
    worst_ms: f64,
    mean_ms: f64,
}

/// Plans every 0.3 s, takes the candidate with the least sum of distances to go, and tracks it.
fn drive(world: &World, start: Pose2, goal: Point2, walkers: &mut Walkers, seed: u64) -> Drive {
    let generator = RrtStarGenerator::default();
    let robot = &world.robot;
    let contact = robot.radius() + walkers.people.radius;
    let (mut pose, mut twist, mut tree) = (start, Twist::default(), None);
    let mut chosen: Option<(CandidateSet, Pose2, Twist, u64)> = None;
    let mut d = Drive {
        reached: false,
        contacts: 0,
        seconds: 0.0,
        stops: 0,
        length: 0.0,
        worst_ms: 0.0,
        mean_ms: 0.0,
    };
    let mut cycles = 0;
    for tick in 0..1200_u64 {
        if tick % 3 == 0 {
            let scene = scene(tick, pose, twist, &walkers.people);
            let tail: Vec<Pose2> = chosen.as_ref().map_or(Vec::new(), |(set, _, _, at)| {
                let passed = ((tick - at) / 3) as usize;
                (passed.min(13)..13).map(|k| Pose2::new(set.x()[k], set.y()[k], set.heading()[k])).collect()
            });
            let begin = std::time::Instant::now();
            let answer = generator.generate(&world.input(&scene, Some(&tail)), tree.take(), seed, &|| false);
            let ms = begin.elapsed().as_secs_f64() * 1e3;
            d.worst_ms = d.worst_ms.max(ms);
            d.mean_ms += ms;
            cycles += 1;
            tree = Some(answer.tree);
            let set = answer.candidates;
            let cost = |i: usize| -> f64 {
                set.range(i)
                    .map(|k| world.geodesic.at(&world.map.grid, Point2::new(set.x()[k], set.y()[k])))
                    .sum()
            };
            let best = (0..set.len()).min_by(|&a, &b| cost(a).total_cmp(&cost(b)));
            match best {
                Some(i) => chosen = Some((set.slice(i..i + 1), pose, twist, tick)),
                None => {
                    // Hold while what is left of the last decision is free, else stop.
                    let checker = CollisionChecker::new(
                        &world.map,
                        robot,
                        &scene,
                        ForecastParams::default(),
                        &CollisionParams::default(),
                    );
                    let (x, y, h): (Vec<f64>, Vec<f64>, Vec<f64>) = (
                        tail.iter().map(|p| p.x).collect(),
                        tail.iter().map(|p| p.y).collect(),
                        tail.iter().map(|p| p.heading).collect(),
                    );
                    if checker.first_collision(&x, &y, &h, 0.3).is_some() {
                        chosen = None;
                    }
                    d.stops += 1;
                }
            }
        }
        let wanted = match &chosen {
            Some((set, start, start_twist, at)) => {
                let reference = Reference {
                    start: *start,
                    start_twist: *start_twist,
                    dt: set.dt(),
                    x: set.x(),
                    y: set.y(),
                    heading: set.heading(),
                    v: set.v(),
                    omega: set.omega(),
                };
                let t = 0.1 * (tick - at) as f64;
                track(&reference, t, pose, twist, robot, 0.1, &TrackingParams::default())
            }
            None => Twist::default(),
        };
        twist = robot.limit(twist, wanted, 0.1);
        pose = step(pose, twist, 0.1);
        d.length += twist.v * 0.1;
        walkers.walk(0.1, pose.position(), contact);
        let touched =
            (0..walkers.people.len()).any(|i| walkers.people.position(i).distance(pose.position()) < contact);
        let walled = world.map.to_obstacle.at(&world.map.grid, pose.position()) < robot.radius();
        if (touched || walled) && twist.v > 0.05 {
            println!("tick {tick}: walled {walled} at {pose:?} {twist:?} chosen {}", chosen.is_some());
            for i in 0..walkers.people.len() {
                let p = walkers.people.position(i);
                if p.distance(pose.position()) < 1.0 {
                    println!(
                        "  person {i} d {:.3} v {:.2} {:.2} rel {:?}",
                        p.distance(pose.position()),
                        walkers.people.vx[i],
                        walkers.people.vy[i],
                        pose.inverse_transform(p)
                    );
                }
            }
            d.contacts += 1;
        }
        d.seconds += 0.1;
        if pose.position().distance(goal) < 0.3 {
            d.reached = true;
            break;
        }
    }
    d.mean_ms /= f64::from(cycles);
    d
}

#[test]
fn the_goal_is_reached_without_contact_alone_and_among_twenty_walkers() {
    let (start, goal) = (Pose2::new(3.0, 3.0, -2.0), Point2::new(26.0, 27.0));
    let world = World::new(furnished(), goal);
    for count in [0, 20] {
        for seed in 0..5 {
            let mut walkers = Walkers::random(count, &world.map, &[start.position(), goal], seed);
            let d = drive(&world, start, goal, &mut walkers, seed);
            println!(
                "{count} walkers, seed {seed}: reached {} in {:.1} s, {:.1} m, {} contacts, {} cycles without candidate, generate {:.2} ms mean {:.2} ms worst",
                d.reached, d.seconds, d.length, d.contacts, d.stops, d.mean_ms, d.worst_ms
            );
            assert!(d.reached, "{count} walkers, seed {seed}: not reached in {:.0} s", d.seconds);
            assert_eq!(d.contacts, 0, "{count} walkers, seed {seed}");
        }
    }
}

#[test]
fn moving_on_keeps_most_of_the_tree() {
    let world = World::new(furnished(), Point2::new(14.0, 26.0));
    let people = People { radius: 0.3, ..People::default() };
    let params = GenerationParams::default();
    for seed in 0..5 {
        let mut tree = None;
        let mut pose = Pose2::new(15.0, 2.0, 1.6);
        for k in 0..5 {
            let scene = scene(3 * k, pose, Twist { v: 0.9, omega: 0.0 }, &people);
            let input = world.input(&scene, None);
            let answer = RrtStarGenerator::default().generate(&input, tree.take(), seed, &|| false);
            let best = (0..answer.candidates.len()).next().unwrap();
            let first = answer.candidates.range(best).start;
            let set = &answer.candidates;
            let next = Pose2::new(set.x()[first], set.y()[first], set.heading()[first]);
            let moved = self::scene(3 * k + 3, next, Twist { v: 0.9, omega: 0.0 }, &people);
            let checker = CollisionChecker::new(
                &world.map,
                &world.robot,
                &moved,
                ForecastParams::default(),
                &params.collision,
            );
            // reachable: still in the disc and not behind the robot's turning circles
            let reachable = (1..answer.tree.len())
                .filter(|&n| {
                    let p = next.inverse_transform(answer.tree.position(n));
                    answer.tree.position(n).distance(next.position()) < 4.9 && p.x > 0.0
                })
                .count();
            let kept = update::reroot(&answer.tree, next, 4.9, &params.tree, &checker);
            assert_eq!(kept.check(), Ok(()));
            println!(
                "seed {seed} cycle {k}: {} nodes, {reachable} reachable, {} kept",
                answer.tree.len(),
                kept.len()
            );
            assert!(kept.len() * 2 >= reachable, "seed {seed}: {} of {reachable}", kept.len());
            tree = Some(answer.tree);
            pose = next;
        }
    }
}

#[test]
fn cells_of_candidates_cover_many_directions() {
    let world = World::new(hall(&[]), Point2::new(15.0, 25.0));
    let people = People { radius: 0.3, ..People::default() };
    let scene = scene(0, Pose2::new(15.0, 15.0, 1.57), Twist { v: 0.5, omega: 0.0 }, &people);
    let set = RrtStarGenerator::default().generate(&world.input(&scene, None), None, 1, &|| false).candidates;
    let sectors: BTreeSet<i64> = (0..set.len())
        .map(|i| {
            let end = Point2::new(set.x()[set.range(i).end - 1], set.y()[set.range(i).end - 1]);
            (crate::geometry::bearing(Point2::new(15.0, 15.0), end) / 0.5).floor() as i64
        })
        .collect();
    // 0.5 rad sectors: more than the front quarter to either side
    assert!(sectors.len() >= 5, "{sectors:?}");
}
