//! Properties of whole runs.

use curionav_planning::occupancy::{MapYaml, OccupancyGrid, load_map};
use curionav_planning::random::uniform;

use super::*;
use crate::scenario::{Motion, PerceivedPeople, RecordingFormat, WalkMode, Walker};
use crate::walkers::WAITING_MARGIN;

/// A hall of 20 m x 12 m with outer walls and pillars, its lower left corner at `origin`.
fn hall(origin: Point2) -> StaticMap {
    let (width, height) = (400, 240);
    let cells = (0..width * height)
        .map(|i| {
            let (c, r) = (i % width, i / width);
            let outer = c < 2 || r < 2 || c >= width - 2 || r >= height - 2;
            let pillar = (c / 4) % 25 == 12 && (r / 4) % 20 == 5;
            if outer || pillar { 100 } else { 0 }
        })
        .collect();
    let origin = Pose2::new(origin.x, origin.y, 0.0);
    StaticMap::new(OccupancyGrid::new(width, height, 0.05, origin, cells).unwrap())
}

/// Two walkers and a recording, everything shifted by (dx, dy).
fn scenario(dx: f64, dy: f64) -> Scenario {
    let p = |x: f64, y: f64| format!("[{}, {}]", x + dx, y + dy);
    Scenario::from_toml(&format!(
        "name = \"hall\"\nmap = {{ file = \"hall.yaml\" }}\n\
         [robot]\nstart = [{}, {}, 0.1]\ngoal = {}\n\
         [[walkers]]\nroute = [{}, {}]\nspeed = 0.7\npause_s = 0.5\n\
         [[walkers]]\nroute = [{}, {}, {}]\nspeed = 1.1\nmode = \"loop\"\n\
         [[recorded]]\nfile = \"r.txt\"\nformat = \"text\"\nfps = 25\npose = [{}, {}, 0.5]\nloop = true\n",
        2.0 + dx,
        6.0 + dy,
        p(17.0, 6.0),
        p(10.0, 6.0),
        p(3.0, 6.0),
        p(6.0, 3.0),
        p(8.0, 3.0),
        p(8.0, 9.0),
        4.0 + dx,
        7.0 + dy,
    ))
    .unwrap()
}

fn recording() -> Recording {
    let text = "0 1 0 0\n10 1 0.3 0.1\n20 1 0.7 0.1\n30 1 1.0 0.4\n10 2 2 0\n20 2 2 0.5\n";
    Recording::parse(text, RecordingFormat::Text, 25.0).unwrap()
}

/// Truths and observations of a run driven by seeded random commands.
fn run(dx: f64, dy: f64, seed: u64) -> Vec<(Truth, Observation)> {
    let mut world =
        World::new(&scenario(dx, dy), hall(Point2::new(dx, dy)), vec![recording()], seed).unwrap();
    let mut r = rng(99, 0);
    (0..200)
        .map(|_| {
            let seen = (world.truth(), world.observe());
            world.step(Twist { v: uniform(&mut r), omega: uniform(&mut r) - 0.5 });
            seen
        })
        .collect()
}

#[test]
fn same_seed_same_run() {
    assert_eq!(run(0.0, 0.0, 7), run(0.0, 0.0, 7));
    let (a, b) = (run(0.0, 0.0, 7), run(0.0, 0.0, 8));
    assert_ne!(a[0].0.pose, b[0].0.pose);
    assert_ne!(a[0].1.ranges, b[0].1.ranges);
}

#[test]
fn beams_that_fail_change_nothing_else() {
    let well =
        World::new(&scenario(0.0, 0.0), hall(Point2::default()), vec![recording()], 7).unwrap().observe();
    let mut failing = scenario(0.0, 0.0);
    failing.laser_faults.silent_share = 0.2;
    let world = World::new(&failing, hall(Point2::default()), vec![recording()], 7).unwrap();
    let seen = world.observe();
    let pairs: Vec<(f32, f32)> = seen.ranges.iter().copied().zip(well.ranges).collect();
    assert!(pairs.iter().all(|(failing, well)| failing.is_nan() || failing == well));
    let silent = pairs.iter().filter(|(failing, _)| failing.is_nan()).count();
    // 181 beams: 36 on the mean, with a standard deviation of 5.4.
    assert!((15..=57).contains(&silent), "{silent}");
}

#[test]
fn moving_the_world_moves_nothing() {
    for seed in 0..3 {
        for ((truth, seen), (moved, moved_seen)) in run(0.0, 0.0, seed).iter().zip(&run(64.0, -32.0, seed)) {
            assert!((moved.pose.x - truth.pose.x - 64.0).abs() < 1e-9, "seed {seed}");
            assert!((moved.pose.y - truth.pose.y + 32.0).abs() < 1e-9, "seed {seed}");
            assert!((moved.wall_clearance - truth.wall_clearance).abs() < 0.08, "seed {seed}");
            assert!((moved.person_distance - truth.person_distance).abs() < 1e-9, "seed {seed}");
            let touching = |t: &Truth| t.touching.iter().map(|touch| touch.id).collect::<Vec<_>>();
            assert_eq!(touching(moved), touching(truth));
            let odometry_error = moved_seen.odometry.position().distance(seen.odometry.position());
            assert!(odometry_error < 1e-9, "seed {seed}");
            // a beam that grazes a pillar's edge may fall on its other side
            let pairs = moved_seen.ranges.iter().zip(&seen.ranges);
            let differing = pairs.filter(|(a, b)| (**a - **b).abs() > 1e-4).count();
            assert!(differing <= 2, "seed {seed}: {differing} beams differ");
        }
    }
}

#[test]
fn observing_changes_nothing() {
    let mut world = World::new(&scenario(0.0, 0.0), hall(Point2::default()), vec![recording()], 3).unwrap();
    assert_eq!(world.observe(), world.observe());
    world.step(Twist { v: 1.0, omega: 0.0 });
    assert_eq!(world.observe(), world.observe());
}

#[test]
fn the_true_start_keeps_within_two_sigma_and_has_half_of_it() {
    let map = hall(Point2::default());
    let (mut sum, runs) = (0.0, 400);
    for seed in 0..runs {
        let truth = World::new(&scenario(0.0, 0.0), map.clone(), vec![recording()], seed).unwrap().truth();
        // half of 0.5 m and of pi/12, cut at twice that
        assert!((truth.pose.x - 2.0).abs() <= 0.5 && (truth.pose.y - 6.0).abs() <= 0.5, "seed {seed}");
        assert!((truth.pose.heading - 0.1).abs() <= std::f64::consts::PI / 12.0, "seed {seed}");
        assert!(truth.wall_clearance >= 0.0 && truth.person_clearance >= 0.0, "seed {seed}");
        sum += (truth.pose.x - 2.0).powi(2);
    }
    // a normal cut at two sigma keeps 0.774 of its variance: 0.0625 * 0.774 = 0.0484
    let variance = sum / runs as f64;
    assert!((variance / 0.0484 - 1.0).abs() < 0.2, "{variance}");
}

#[test]
fn walkers_are_never_inside_walls() {
    let map = hall(Point2::default());
    let mut kept = 0;
    for seed in 0..60 {
        let mut r = rng(seed, 1);
        let mut any = || Point2::new(20.0 * uniform(&mut r), 12.0 * uniform(&mut r));
        let route = vec![any(), any(), any()];
        let modes = [WalkMode::BackAndForth, WalkMode::Once, WalkMode::Loop, WalkMode::Stand];
        let mode = modes[seed as usize % 4];
        let mut s = scenario(0.0, 0.0);
        s.recorded.clear();
        s.walkers =
            vec![Walker { route, speed: 1.3, mode, start_offset: 0.0, pause_s: 0.3, heedless: false }];
        let Ok(mut world) = World::new(&s, map.clone(), Vec::new(), seed) else { continue };
        kept += 1;
        for _ in 0..600 {
            world.step(Twist::default());
            let p = world.people().position(0);
            assert!(world.around.distance(p) > 0.0, "seed {seed}");
        }
    }
    assert!(kept >= 20, "only {kept} random routes keep clear of walls");
}

#[test]
fn a_walker_waits_for_a_robot_that_stands_in_its_way() {
    let mut s = scenario(0.0, 0.0);
    (s.recorded, s.robot.start_noise) = (Vec::new(), 0.0);
    s.walkers.truncate(1); // towards the robot, from (10, 6) to (3, 6); the robot stands at (2, 6)
    s.walkers[0].route[1] = Point2::new(1.0, 6.0);
    let mut world = World::new(&s, hall(Point2::default()), Vec::new(), 0).unwrap();
    for _ in 0..300 {
        world.step(Twist::default());
        assert!(world.truth().person_clearance >= WAITING_MARGIN - 1e-9);
    }
    assert_eq!((world.people().vx[0], world.people().vy[0]), (0.0, 0.0));
    assert!(world.truth().person_clearance < WAITING_MARGIN + 0.07 + 1e-9); // within one step of 0.07 m
}

#[test]
fn ids_are_unique_and_ascending_and_live_people_are_people() {
    let mut s = scenario(0.0, 0.0);
    s.perception.people = PerceivedPeople::All;
    let mut world = World::new(&s, hall(Point2::default()), vec![recording()], 0).unwrap();
    let live = People {
        id: vec![0, 4],
        x: vec![5.0, 6.0],
        y: vec![2.0, 2.0],
        vx: vec![0.5, 0.0],
        vy: vec![0.0, 0.0],
        radius: 0.3,
        ..People::default()
    };
    world.replace_live_people(&live);
    for _ in 0..5 {
        world.step(Twist::default());
    }
    let ids = world.observe().people.id; // two walkers, both recorded people, two live
    assert_eq!(ids, [0, 1, 2, 3, FIRST_LIVE_ID, FIRST_LIVE_ID + 4]);
    assert_eq!(world.people().radius, 0.25);
}

#[test]
fn recordings_must_fit_the_scenario() {
    let mut s = scenario(0.0, 0.0);
    let error = World::new(&s, hall(Point2::default()), Vec::new(), 0).unwrap_err();
    assert_eq!(error.field, "recorded");
    s.recorded[0].ids = Some(vec![1, 9]);
    let error = World::new(&s, hall(Point2::default()), vec![recording()], 0).unwrap_err();
    assert_eq!(error.field, "recorded[0].ids");
    s.recorded[0].ids = None;
    let world = World::new(&s, hall(Point2::default()), vec![recording()], 0).unwrap();
    let extent = world.recorded().next().unwrap();
    assert_eq!((extent.people, extent.span, extent.on_floor), (2, (0.0, 1.2), 1.0));
    assert!(extent.corners.0.x < extent.corners.1.x);
    // Of people who would never be seen.
    let pose = std::mem::replace(&mut s.recorded[0].pose, Pose2::new(500.0, 500.0, 0.0));
    let error = World::new(&s, hall(Point2::default()), vec![recording()], 0).unwrap_err();
    assert_eq!(error.field, "recorded[0].pose");
    (s.recorded[0].pose, s.recorded[0].start_s, s.recorded[0].r#loop) = (pose, 300.0, false);
    let error = World::new(&s, hall(Point2::default()), vec![recording()], 0).unwrap_err();
    assert_eq!(error.field, "recorded[0].start_s");
}

#[test]
fn people_who_avoid_see_the_robot_and_those_who_do_not() {
    let mut s = scenario(0.0, 0.0);
    (s.people.motion, s.robot.start_noise) = (Motion::Hrvo, 0.0);
    let play = || {
        let mut world = World::new(&s, hall(Point2::default()), vec![recording()], 5).unwrap();
        let mut least = f64::INFINITY;
        for _ in 0..300 {
            world.step(Twist::default());
            let (truth, people) = (world.truth(), world.people().clone());
            least = least.min(truth.person_clearance);
            for i in 0..2 {
                assert!(world.around.distance(people.position(i)) > 0.15);
                // the recorded walk through each other, not the walkers through them
                let near = |j: &usize| people.position(i).distance(people.position(*j)) < 0.45;
                assert!(!(0..people.len()).filter(|j| *j != i).any(|j| near(&j)), "{people:?}");
            }
        }
        assert!(least > -1e-6, "{least}");
        world.people().clone()
    };
    assert_eq!(play(), play());
}

#[test]
fn all_people_of_the_published_scene_keep_walking_when_they_avoid() {
    let file = |name: &str| {
        std::fs::read(format!("{}/../../scenarios/paper/{name}", env!("CARGO_MANIFEST_DIR"))).unwrap()
    };
    let text = |name: &str| String::from_utf8(file(name)).unwrap();
    let mut s = Scenario::from_toml(&text("env4-s2.toml")).unwrap();
    s.people.motion = Motion::Hrvo;
    let yaml = MapYaml::parse(&text("maps/env4-s2.yaml")).unwrap();
    let map = StaticMap::new(load_map(&yaml, &file("maps/env4-s2.pgm")).unwrap());
    let mut world = World::new(&s, map, Vec::new(), 1000).unwrap();
    let start = world.people().clone();
    let mut walked = vec![0.0; start.len()];
    let mut least = f64::INFINITY;
    for _ in 0..1200 {
        let before = world.people().clone();
        world.step(Twist::default());
        for (i, walked) in walked.iter_mut().enumerate() {
            *walked += before.position(i).distance(world.people().position(i));
            for j in 0..i {
                least = least.min(world.people().position(i).distance(world.people().position(j)));
            }
        }
    }
    let shares: Vec<f64> = walked.iter().zip(&s.walkers).map(|(way, w)| way / (120.0 * w.speed)).collect();
    // rests and detours cost some of the way
    assert!(shares.iter().all(|share| *share > 0.3), "{shares:?}");
    assert!(least > 0.499, "{least}");
}

#[test]
fn who_comes_into_being_too_late_for_the_robot_to_stop_touches_it_only_after_they_have_parted() {
    let scenario = Scenario::from_toml(
        "name = \"hall\"\nmap = { file = \"hall.yaml\" }\n\
         [robot]\nstart = [2.0, 6.0, 0.0]\ngoal = [17.0, 6.0]\nstart_noise = 0.0\n\
         [[recorded]]\nfile = \"r.txt\"\nformat = \"text\"\nfps = 10\n",
    )
    .unwrap();
    // The ticks at which the robot at (2, 6), which needs 2.3 s to stop, is touched: contact is at 0.55 m.
    let touched = |rows: &str| {
        let recording = Recording::parse(rows, RecordingFormat::Text, 10.0).unwrap();
        let mut world = World::new(&scenario, hall(Point2::default()), vec![recording], 0).unwrap();
        let mut ticks = Vec::new();
        for tick in 0..40 {
            if !world.truth().touching.is_empty() {
                ticks.push(tick);
            }
            world.step(Twist::default());
        }
        ticks
    };
    // Person 1 stands far off; person 2 comes at 1 m/s.
    let walking = |first: i32, x: f64| {
        let row = |k: i32| format!("{} 2 {} 6\n", first + k, x - 0.1 * f64::from(k));
        format!("0 1 9 9\n40 1 9 9\n{}", (0..=35).map(row).collect::<String>())
    };
    assert_eq!(touched(&walking(0, 3.0)).first(), Some(&5), "who is there from the start can be known");
    assert_eq!(touched(&walking(4, 3.0)), Vec::<i32>::new(), "0.5 s before the contact");
    assert_eq!(touched(&walking(4, 5.5)).first(), Some(&34), "3 s before the contact");
    // On the robot at 0.4 s, 2 m away at 0.8 s, and back at 1.2 s: they have parted, and the person is still new.
    assert_eq!(touched("0 1 9 9\n4 2 2 6\n8 2 4 6\n12 2 2 6\n"), Vec::<i32>::new());
    // On the robot from 0.4 s to 3 s, which is longer than it needs, 2 m away at 3.4 s, and back at 3.8 s at 5 m/s.
    assert_eq!(touched("0 1 9 9\n4 2 2 6\n20 2 2 6\n30 2 2 6\n34 2 4 6\n38 2 2 6\n42 2 2 6\n"), [37, 38, 39]);
}
