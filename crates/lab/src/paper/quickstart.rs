//! The first scene a user runs: a small foyer, four people, ten metres to go.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::sensor::LaserModel;

use super::layout::{Layout, polygon, rectangle};
use super::patrol::PatrolParams;
use super::plan::{Plan, furnish};
use super::scene::PaperScene;
use super::scene_error::SceneError;

/// Side of a cell, metres.
const CELL_M: f64 = 0.05;
const PEOPLE: usize = 4;

/// Makes the quick start's scene. `seed` draws the people's patrols.
pub fn quickstart(seed: u64) -> Result<PaperScene, SceneError> {
    let plan = plan();
    let grid = plan.layout.grid(CELL_M, None)?;
    let patrols = PatrolParams { length: (2.5, 5.0), away: 1.5, ..PatrolParams::default() };
    furnish("quickstart".to_owned(), plan, grid, LaserModel::default(), PEOPLE, patrols, seed)
}

fn plan() -> Plan {
    Plan {
        layout: Layout {
            outline: polygon(&[
                (0.0, 0.0),
                (7.0, 0.0),
                (7.0, 0.6),
                (8.6, 0.6),
                (8.6, 0.0),
                (12.0, 0.0),
                (12.0, 7.6),
                (10.6, 9.0),
                (3.4, 9.0),
                (3.4, 8.3),
                (0.0, 8.3),
            ]),
            masonry: vec![rectangle(-1.0, -1.0, 13.0, 10.0)],
            furniture: vec![
                rectangle(3.2, 1.4, 3.8, 2.6),
                rectangle(5.6, 6.4, 7.2, 7.0),
                polygon(&[(8.9, 2.6), (9.5, 3.2), (9.1, 3.6), (8.5, 3.0)]),
            ],
        },
        start: Pose2::new(1.0, 4.0, 0.0),
        goal: Point2::new(11.0, 5.2),
        routes: Vec::new(),
        crowds: vec![(rectangle(2.8, 1.0, 9.6, 8.4), 1.0)],
        description: "Foyer with four people and landmarks all around: ten metres, half a minute.",
    }
}
