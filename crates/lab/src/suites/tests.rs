use curionav_crowdsim::Scenario;
use curionav_crowdsim::world::World;
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
    assert_eq!((of_folder(&files, "closed").len(), of_folder(&files, "reopened").len()), (4, 4));
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
