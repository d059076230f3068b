//! Whole missions in closed loop, without noise: generate, take the least distance to go, track.

use super::*;
use crate::states::States;
use crate::tracking::track;
use crate::trajectory::Trajectory;

/// People who walk to and fro, and wait when the robot stands in their way.
struct Walkers {
    people: People,
    velocity: Vec<(f64, f64)>,
    /// Seconds each still pauses at the end of its beat.
    pause: Vec<f64>,
    ends: Vec<(Point2, Point2)>,
}

impl Walkers {
    fn random(count: u32, map: &StaticMap, keep_away: &[Point2], seed: u64) -> Self {
        let mut r = rng(seed, 77);
        let mut w = Self {
            people: People { radius: 0.3, ..People::default() },
            velocity: Vec::new(),
            pause: Vec::new(),
            ends: Vec::new(),
        };
        while (w.ends.len() as u32) < count {
            let mut draw = || Point2::new(1.0 + 28.0 * uniform(&mut r), 1.0 + 28.0 * uniform(&mut r));
            let a = draw();
            let b = draw();
            let speed = 0.3 + 0.7 * uniform(&mut r);
            let length = a.distance(b);
            let clear = (0..=100).all(|k| {
                let s = f64::from(k) / 100.0;
                let p = a.toward(b, s);
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
            w.pause.push(0.0);
            w.ends.push((a, b));
        }
        w
    }

    fn walk(&mut self, dt: f64, robot: Point2, contact: f64) {
        for i in 0..self.people.len() {
            let p = self.people.position(i);
            if self.pause[i] > 0.0 {
                self.pause[i] -= dt;
                (self.people.vx[i], self.people.vy[i]) = (0.0, 0.0);
                continue;
            }
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
                self.pause[i] = 1.0;
                self.ends[i] = (b, a);
            }
        }
    }
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
fn drive(
    generator: &Generator,
    world: &World,
    start: Pose2,
    goal: Point2,
    walkers: &mut Walkers,
    seed: u64,
) -> Drive {
    let robot = &world.robot;
    let contact = robot.radius() + walkers.people.radius;
    let mut pose = start;
    let mut twist = Twist::default();
    let mut tree = None;
    let mut chosen: Option<(Trajectory, u64)> = None;
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
            let tail: Vec<Pose2> = chosen.as_ref().map_or(Vec::new(), |(trajectory, at)| {
                let passed = ((tick - at) / 3) as usize;
                (passed..trajectory.len()).map(|k| trajectory.states().at(k).0).collect()
            });
            let begin = std::time::Instant::now();
            let answer = generator.generate(&world.input(&scene, Some(&tail)), tree.take(), seed, &|| 0.0);
            let ms = begin.elapsed().as_secs_f64() * 1e3;
            d.worst_ms = d.worst_ms.max(ms);
            d.mean_ms += ms;
            cycles += 1;
            tree = Some(answer.tree);
            let set = answer.candidates;
            let cost = |i: usize| -> f64 {
                set.range(i).map(|k| world.geodesic.at(set.all_states().position(k))).sum()
            };
            let best = (0..set.len()).min_by(|&a, &b| cost(a).total_cmp(&cost(b)));
            match best {
                Some(i) => chosen = Some((Trajectory::of(&set, i, (pose, twist)), tick)),
                None => {
                    // Hold while what is left of the last decision is free, else stop.
                    let checker = CollisionChecker::new(
                        &world.map,
                        robot,
                        &scene,
                        ForecastParams::default(),
                        &CollisionParams::default(),
                    );
                    let mut left = States::default();
                    tail.iter().for_each(|&pose| left.push(pose, Twist::default()));
                    if checker.first_collision(&left, 0.3).is_some() {
                        chosen = None;
                    }
                    d.stops += 1;
                }
            }
        }
        let wanted = match &chosen {
            Some((trajectory, at)) => {
                let t = 0.1 * (tick - at) as f64;
                track(trajectory, t, pose, twist, robot, 0.1)
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
    let start = Pose2::new(3.0, 3.0, -2.0);
    let goal = Point2::new(26.0, 27.0);
    let world = World::new(furnished(), goal);
    for count in [0, 20] {
        for seed in 0..5 {
            let mut walkers = Walkers::random(count, &world.map, &[start.position(), goal], seed);
            let d = drive(&Generator::rrt_star(), &world, start, goal, &mut walkers, seed);
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
fn who_touches_a_wall_gets_away_from_it_whichever_way_it_looks() {
    let goal = Point2::new(16.0, 29.0);
    let world = World::new(hall(&[]), goal);
    for steps in [8, 13] {
        let mut generator = Generator::rrt_star();
        generator.params.steps = steps;
        for k in 0..16 {
            // A tenth of a metre too near.
            let start = Pose2::new(12.0, 29.6, std::f64::consts::TAU * f64::from(k) / 16.0);
            let mut no_people = Walkers::random(0, &world.map, &[], 1);
            let d = drive(&generator, &world, start, goal, &mut no_people, 1);
            println!("{steps} steps, {start:?}: {:.1} s, {} stops", d.seconds, d.stops);
            assert!(d.reached && d.seconds < 30.0, "{steps} steps, {start:?}: {:.0} s", d.seconds);
        }
    }
}
