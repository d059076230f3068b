//! The paper's scenes with people anywhere on the floor.

use curionav_crowdsim::scenario::{Crowd, PlannerChoice};

use super::files::{File, in_company, scenario_file, walking};
use crate::paper::{SEED, environments};

/// Share of people who rest at the ends of their way, as in the curated scenes.
const RESTING: f64 = 0.33;

pub(super) fn files() -> anyhow::Result<Vec<File>> {
    let file = |scene: crate::paper::PaperScene| {
        let mut scenario = scene.scenario;
        let people = scenario.walkers.len();
        let resting = (RESTING * people as f64).round() as usize;
        scenario.crowds = vec![Crowd { pause_s: [0.5, 6.0], ..walking(resting) }];
        scenario.crowds.extend(in_company(walking(people - resting)));
        scenario.walkers.clear();
        scenario.planner = PlannerChoice::default();
        scenario.map.file = format!("../paper/maps/{}.yaml", scenario.name);
        scenario.description = format!("The hall and task of {}, with people anywhere.", scenario.name);
        scenario.name += "-open";
        scenario_file("open", &scenario)
    };
    environments(SEED)?.into_iter().map(file).collect()
}
