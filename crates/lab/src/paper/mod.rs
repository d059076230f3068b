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
mod files;
mod layout;
mod observability;
mod patrol;
mod published;
mod report;
mod route;
mod scene;

use curionav_crowdsim::scenario::{Clock, Motion, Recorded, RecordingFormat};
use curionav_planning::geometry::Pose2;
use curionav_planning::sensor::LaserModel;

use drawing::Plan;
use layout::Counts;
use patrol::rounded;
use published::{CELL_M, Published};

pub use check::check;
pub use files::committed;
pub(crate) use published::PUBLISHED;
pub use report::Report;
pub use scene::PaperScene;

/// Seed of the committed scenes.
pub const SEED: u64 = 1;
/// Side of a cell in the scenes that are not the paper's, metres.
const OWN_CELL_M: f64 = 0.05;

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
        pose: Pose2::default(),
        ids: None,
        r#loop: false,
    }];
    Ok(scene)
}
