use curionav_crowdsim::Scenario;
use curionav_crowdsim::scenario::{Behaviour, Recorded};
use curionav_crowdsim::world::World;
use curionav_planning::geometry::Point2;
use curionav_testing::skip;

use super::*;
use crate::paper::{PaperScene, SEED, environments};

#[test]
fn the_committed_files_are_what_the_generator_writes() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios");
    let (files, missing) = committed().unwrap();
    for (path, bytes) in files {
        let found = std::fs::read(format!("{folder}/{path}")).unwrap_or_default();
        assert!(found == bytes, "{path} differs; run `curionav scenario generate scenarios`");
    }
    missing.iter().for_each(|missing| skip(missing));
}

/// The scenarios of a folder.
fn of_folder(files: &[File], folder: &str) -> Vec<Scenario> {
    let scenario = |(path, text): &File| {
        let is_of = path.split('/').next() == Some(folder) && path.ends_with(".toml");
        is_of.then(|| Scenario::from_toml(std::str::from_utf8(text).unwrap()).unwrap())
    };
    files.iter().filter_map(scenario).collect()
}

#[test]
fn every_changed_floor_has_things_on_no_map_and_a_twin_whose_map_has_them() {
    let files = changed::files().unwrap();
    let changed = of_folder(&files, "changed");
    let mapped = of_folder(&files, "changed-mapped");
    assert!(changed.len() == 56 && mapped.len() == 56);
    for (scenario, twin) in changed.iter().zip(&mapped) {
        assert_eq!((&scenario.name, scenario.robot.goal), (&twin.name, twin.robot.goal));
        assert_eq!(scenario.crowds.is_empty(), scenario.name.ends_with("-empty"));
        let standing = |s: &Scenario| s.world.objects.iter().filter(|object| object.route.is_empty()).count();
        assert!(standing(scenario) >= 2 && standing(twin) == 0, "{}", scenario.name);
        assert!(twin.world.openings.is_empty());
    }
    let pushed = changed.iter().filter(|s| s.world.objects.iter().any(|object| !object.route.is_empty()));
    assert!(pushed.count() > 20, "hardly any trolley is pushed");
    assert_eq!((of_folder(&files, "closed").len(), of_folder(&files, "reopened").len()), (8, 8));
}

/// A moment of a film: seconds, and where one of the people was.
type Frame = (f64, Point2);

fn frame(line: &str, fps: f64) -> Frame {
    let numbers: Vec<f64> = line.split_whitespace().map(|number| number.parse().unwrap()).collect();
    (numbers[0] / fps, Point2::new(numbers[2], numbers[4]))
}

/// What a film has, if it is at hand.
#[track_caller]
fn frames(film: &Recorded) -> Option<Vec<Frame>> {
    let path = film.file.strip_prefix("dataset:").unwrap();
    let text = std::fs::read_to_string(curionav_testing::reference_data(path)?).unwrap();
    Some(text.lines().map(|line| frame(line, film.fps)).collect())
}

#[test]
fn no_second_of_a_film_is_used_twice_and_tasks_are_where_people_walk() {
    let scenarios = of_folder(&recorded::files().unwrap(), "recorded");
    assert_eq!(scenarios.len(), 11);
    for (k, scenario) in scenarios.iter().enumerate() {
        let film = &scenario.recorded[0];
        let begin = film.start_s..film.start_until_s.unwrap();
        let until = begin.end + scenario.clock.time_limit_s;
        for other in scenarios[k + 1..].iter().filter(|other| other.recorded[0].file == film.file) {
            assert!(until <= other.recorded[0].start_s, "{} and {}", scenario.name, other.name);
        }
        let Some(frames) = frames(film) else { return };
        assert!(frames.iter().any(|(time, _)| *time > until - 5.0), "{} outlasts its film", scenario.name);
        let start = scenario.robot.start.position();
        for place in [start, scenario.robot.goal] {
            let walked = frames.iter().filter(|(_, p)| p.distance(place) < 0.5).count();
            assert!(walked >= 10, "{}: {walked} frames at {place:?}", scenario.name);
        }
        let near = frames.iter().filter(|(time, p)| begin.contains(time) && p.distance(start) < 1.2);
        assert_eq!(near.count(), 0, "{}", scenario.name);
    }
}

#[test]
fn people_of_drawn_suites_are_fast_and_slow_alone_in_groups_and_heedless() {
    let (files, _) = committed().unwrap();
    let suites = [
        "open",
        "halls",
        "dense",
        "rooms",
        "narrow",
        "changed",
        "changed-mapped",
        "closed",
        "reopened",
        "training",
    ];
    for suite in suites {
        let crowds: Vec<_> = of_folder(&files, suite).into_iter().flat_map(|s| s.crowds).collect();
        let walking: Vec<_> = crowds.iter().filter(|c| c.behaviour == Behaviour::Walk).collect();
        assert!(!walking.is_empty(), "{suite}");
        assert!(walking.iter().all(|c| c.speed == [0.8, 1.6] && c.heedless == 0.2), "{suite}");
        let grouped: u32 = walking.iter().filter(|c| c.group[1] > 1).map(|c| c.count).sum();
        let all: u32 = walking.iter().map(|c| c.count).sum();
        let share = f64::from(grouped) / f64::from(all);
        assert!((0.2..=0.5).contains(&share), "{suite}: {share}");
    }
}

#[test]
fn halls_are_as_many_places_as_a_test_over_places_needs() {
    let files = halls::files().unwrap();
    let scenarios = of_folder(&files, "halls");
    let maps: std::collections::BTreeSet<&Vec<u8>> =
        files.iter().filter(|(path, _)| path.ends_with(".pgm")).map(|(_, bytes)| bytes).collect();
    assert_eq!((scenarios.len(), maps.len()), (25, 25));
    let largest = maps.iter().map(|bytes| bytes.len()).max().unwrap();
    assert!(largest < 150_000, "{largest} bytes");
}

fn world(scene: &PaperScene, scenario: &Scenario, seed: u64) -> World {
    World::new(scenario, scene.map.clone(), vec![], seed).unwrap()
}

/// The paper's scenes, each with its open variant.
fn variants() -> Vec<(PaperScene, Scenario)> {
    let scenario = |(_, text): File| Scenario::from_toml(std::str::from_utf8(&text).unwrap()).unwrap();
    environments(SEED).unwrap().into_iter().zip(open::files().unwrap().into_iter().map(scenario)).collect()
}

#[test]
fn the_open_scenes_have_the_people_of_table_2_for_every_seed() {
    for (scene, scenario) in variants() {
        for seed in 1..=10 {
            let people = world(&scene, &scenario, seed).people().len();
            assert_eq!(people, scene.scenario.walkers.len(), "{}, seed {seed}", scenario.name);
        }
    }
}

/// Mean number of people within 2 m of the direct way from start to goal, over a minute.
fn busy(scene: &PaperScene, scenario: &Scenario, seed: u64) -> f64 {
    let mut world = world(scene, scenario, seed);
    let start = scenario.robot.start.position();
    let goal = scenario.robot.goal;
    let way = goal.distance(start);
    let mut sum = 0.0;
    for _ in 0..60 {
        for _ in 0..10 {
            world.step(Default::default());
        }
        let people = world.people();
        let near = (0..people.len()).filter(|&i| {
            let p = people.position(i);
            let along = ((p.x - start.x) * (goal.x - start.x) + (p.y - start.y) * (goal.y - start.y)) / way;
            let foot = start.toward(goal, (along / way).clamp(0.0, 1.0));
            foot.distance(p) < 2.0
        });
        sum += near.count() as f64 / 60.0;
    }
    sum
}

#[test]
fn seeds_of_an_open_scene_differ_as_scenes_do() {
    let spread = |values: &[f64]| {
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / (values.len() - 1) as f64).sqrt()
    };
    let [mut open, mut curated] = [Vec::new(), Vec::new()];
    let mut means = Vec::new();
    for (scene, scenario) in variants().iter().filter(|(s, _)| s.scenario.name.ends_with("s2")) {
        let people: Vec<f64> = (1..=10).map(|seed| busy(scene, scenario, seed)).collect();
        open.push(spread(&people));
        means.push(people.iter().sum::<f64>() / 10.0);
        let people: Vec<f64> = (1..=3).map(|seed| busy(scene, &scene.scenario, seed)).collect();
        curated.push(spread(&people));
    }
    let between = spread(&means);
    let mean = |values: &[f64]| values.iter().sum::<f64>() / values.len() as f64;
    println!(
        "over seeds {:.2}, over scenes {between:.2}, curated over seeds {:.2}",
        mean(&open),
        mean(&curated)
    );
    assert!(mean(&curated) < 1e-9, "a curated scene has one crowd: {curated:?}");
    assert!(mean(&open) > 0.5 * between, "over seeds {open:?}, over scenes {between}");
}
