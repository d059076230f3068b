//! The paper's scenes, redrawn from the only numbers it prints about them.
//!
//! The maps themselves are not published as data, so each is designed anew (A35) to have exactly the
//! published counts of known and landmark cells, people and laser range, and the three kinds of route
//! the paper argues with (D16): free but bare of landmarks, with landmarks but crowded, free with
//! landmarks. [`check`] measures all of that on the finished scene and trusts nothing of how it was drawn.
//!
//! Read in this order: `published` (what is given), `drawings/env4.toml` (how a scene is drawn), [`check`].

mod check;
mod drawing;
mod layout;
mod observability;
mod patrol;
mod published;
mod route;
mod scene;

use curionav_crowdsim::scenario::{Clock, Motion, Recorded, RecordingFormat};
use curionav_planning::geometry::Pose2;
use curionav_planning::occupancy::{MapYaml, encode_pgm};
use curionav_planning::sensor::LaserModel;

use drawing::Plan;
use layout::Counts;
use published::CELL_M;

pub use check::{Report, check};
pub(crate) use layout::{Layout, Polygon, bounds};
pub(crate) use patrol::rounded;
pub(crate) use published::{PUBLISHED, Published};
pub use scene::PaperScene;
pub(crate) use scene::task;

/// Seed of the committed scenes.
pub const SEED: u64 = 1;
/// Side of a cell in the scenes that are not the paper's, metres.
pub(crate) const OWN_CELL_M: f64 = 0.05;

/// Makes one of the paper's scenes. `seed` draws the people's patrols; the map is the same for every seed.
fn environment(published: &'static Published, seed: u64) -> anyhow::Result<PaperScene> {
    let name = published.name;
    let (environment, scenario) = name.split_once('-').unwrap_or((name, ""));
    let drawing = match environment {
        "env1" => include_str!("drawings/env1.toml"),
        "env2" => include_str!("drawings/env2.toml"),
        "env3" => include_str!("drawings/env3.toml"),
        _ => include_str!("drawings/env4.toml"),
    };
    let plan = Plan::read(drawing, scenario)?;
    let counts = Counts { known: published.known_cells, occupied: published.landmark_cells };
    let grid = plan.layout.grid(CELL_M, Some(counts))?;
    let laser = LaserModel { range_max: rounded(published.laser_range()), ..LaserModel::default() };
    // S* has the numbers of s1, but is to have other people.
    let seed = if published.hrvo { seed ^ (1 << 32) } else { seed };
    let mut scene = PaperScene::furnish(name, plan, grid, laser, published.people, seed)?;
    scene.scenario.planner.profile = "curiosity".to_owned();
    if published.hrvo {
        scene.scenario.people.motion = Motion::Hrvo;
    }
    Ok(PaperScene { published: Some(published), ..scene })
}

/// All thirteen, in the order of Table II.
pub fn environments(seed: u64) -> anyhow::Result<Vec<PaperScene>> {
    PUBLISHED.iter().map(|published| environment(published, seed)).collect()
}

/// Makes the quick start's scene. `seed` draws the people's patrols.
pub fn quickstart(seed: u64) -> anyhow::Result<PaperScene> {
    let plan = Plan::read(include_str!("drawings/quickstart.toml"), "")?;
    let grid = plan.layout.grid(OWN_CELL_M, None)?;
    PaperScene::furnish("quickstart", plan, grid, LaserModel::default(), 4, seed)
}

/// The street of a recording. Its people come from a file of a dataset that is not part of the project.
fn zara01() -> anyhow::Result<PaperScene> {
    let plan = Plan::read(include_str!("drawings/zara01.toml"), "")?;
    let grid = plan.layout.grid(OWN_CELL_M, None)?;
    let laser = LaserModel { range_max: 8.0, ..LaserModel::default() };
    let mut scene = PaperScene::furnish("zara01", plan, grid, laser, 0, 0)?;
    scene.scenario.clock = Clock { time_limit_s: 90.0, ..Clock::default() };
    scene.scenario.recorded = vec![Recorded {
        file: "dataset:peds_eth_ucy/zara01/obsmat.txt".to_owned(),
        format: RecordingFormat::Obsmat,
        fps: 25.0,
        // The busiest twenty seconds: 11 people at a time.
        start_s: 200.0,
        start_until_s: None,
        pose: Pose2::default(),
        ids: None,
        r#loop: false,
    }];
    Ok(scene)
}

/// Everything the generator writes below `scenarios/`: (path, content), in a fixed order.
pub fn committed() -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let mut all = Vec::new();
    for scene in environments(SEED)? {
        all.extend(files(&scene)?.into_iter().map(|(path, bytes)| (format!("paper/{path}"), bytes)));
    }
    all.extend(files(&quickstart(SEED)?)?);
    let real = files(&zara01()?)?;
    all.extend(real.into_iter().map(|(path, bytes)| (format!("real/{path}"), bytes)));
    Ok(all)
}

/// Paths relative to the scenario's folder, and contents. The same scene gives the same bytes.
fn files(scene: &PaperScene) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let name = &scene.scenario.name;
    let header =
        "# Written by `curionav scenario generate`; edit the drawing in crates/lab/src/paper instead.\n";
    let scenario = format!("{header}{}", scene.scenario.to_toml()?);
    let image = format!("{name}.pgm");
    let yaml = MapYaml::trinary(&scene.map.grid, &image).to_text()?;
    Ok(vec![
        (format!("{name}.toml"), scenario.into_bytes()),
        (format!("maps/{name}.yaml"), yaml.into_bytes()),
        (format!("maps/{image}"), encode_pgm(&scene.map.grid)),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_crowdsim::{Maps, Scenario};

    #[test]
    fn the_scenarios_on_real_maps_are_well_formed() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios/real");
        for (file, people) in [("osnabrueck-floor3", 10), ("warehouse", 8)] {
            let text = std::fs::read_to_string(format!("{folder}/{file}.toml")).unwrap();
            let scenario = Scenario::from_toml(&text).unwrap();
            assert_eq!((scenario.name.as_str(), scenario.walkers.len()), (file, people));
        }
    }

    #[test]
    fn a_written_scenario_reads_back_and_fits_its_map() {
        for scene in environments(5).unwrap().into_iter().chain([quickstart(5).unwrap(), zara01().unwrap()]) {
            let toml = String::from_utf8(files(&scene).unwrap()[0].1.clone()).unwrap();
            let scenario = Scenario::from_toml(&toml).unwrap();
            assert_eq!(scenario, scene.scenario);
            scenario.check_on(&Maps::of(scene.map.clone()), &scene.map).unwrap();
        }
    }
}
