//! The paper's scenes, redrawn from the only numbers it prints about them.
//!
//! The maps themselves are not published as data, so each is designed anew (A35) to have exactly the
//! published counts of known and landmark cells, people and laser range, and the three kinds of route
//! the paper argues with (D16): free but bare of landmarks, with landmarks but crowded, free with
//! landmarks. [`check`] measures all of that on the finished scene and trusts nothing of how it was drawn.
//!
//! Read in this order: [`Published`] (what is given), `env4` (how a scene is drawn), [`check`].

mod check;
mod env1;
mod env2;
mod env3;
mod env4;
mod files;
mod layout;
mod observability;
mod patrol;
mod plan;
mod published;
mod quickstart;
mod report;
mod scene;
mod scene_error;
mod zara01;

use curionav_crowdsim::scenario::Motion;
use curionav_planning::sensor::LaserModel;

use layout::Counts;
use patrol::{PatrolParams, rounded};
use plan::furnish;

pub use check::check;
pub use files::{committed, files};
pub use layout::Polygon;
pub use published::{CELL_M, PUBLISHED, Published};
pub use quickstart::quickstart;
pub use report::{Report, RouteReport};
pub use scene::{PaperScene, Route, RouteKind};
pub use scene_error::SceneError;
pub use zara01::zara01;

/// Seed of the committed scenes.
pub const SEED: u64 = 1;

/// Makes one of the paper's scenes. `seed` draws the people's patrols; the map is the same for every seed.
pub fn environment(environment: u8, scenario: &str, seed: u64) -> Result<PaperScene, SceneError> {
    let published = Published::find(environment, scenario)
        .ok_or_else(|| SceneError::Unpublished { environment, scenario: scenario.to_owned() })?;
    let plan = match environment {
        1 => env1::plan(scenario),
        2 => env2::plan(scenario),
        3 => env3::plan(scenario),
        _ => env4::plan(scenario),
    };
    let counts = Counts { known: published.known_cells, occupied: published.landmark_cells };
    let laser = LaserModel { range_max: rounded(published.laser_range()), ..LaserModel::default() };
    let name = format!("env{environment}-{scenario}");
    let grid = plan.layout.grid(CELL_M, Some(counts))?;
    // S* has the numbers of s1, but is to have other people.
    let seed = if published.hrvo { seed ^ (1 << 32) } else { seed };
    let mut scene = furnish(name, plan, grid, laser, published.people, PatrolParams::default(), seed)?;
    if published.hrvo {
        scene.scenario.people.motion = Motion::Hrvo;
    }
    Ok(PaperScene { published: Some(published), ..scene })
}

/// All thirteen, in the order of Table II.
pub fn environments(seed: u64) -> Result<Vec<PaperScene>, SceneError> {
    PUBLISHED.iter().map(|p| environment(p.environment, p.scenario, seed)).collect()
}
