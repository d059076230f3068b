//! The street of the UCY recording `zara01`, with the robot crossing the main flow of people.
//!
//! The recording publishes obstacles only roughly and in two forms that disagree. Taken are the shop of
//! its `map.xml` on the left and the block of its `static.txt` on the right, to the decimetre; walls on
//! both sides and open ends close the recorded area. Coordinates are the recording's own.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::sensor::LaserModel;

use super::layout::{Layout, polygon, rectangle};
use super::patrol::PatrolParams;
use super::plan::{Plan, furnish};
use super::scene::PaperScene;
use super::scene_error::SceneError;
use curionav_crowdsim::scenario::{Clock, Recorded, RecordingFormat};

/// Side of a cell, metres.
const CELL_M: f64 = 0.05;

/// Makes the scene. Its people come from the recording, a file of a dataset that is not part of the project.
pub fn zara01() -> Result<PaperScene, SceneError> {
    let plan = plan();
    let grid = plan.layout.grid(CELL_M, None)?;
    let laser = LaserModel { range_max: 8.0, ..LaserModel::default() };
    let mut scene = furnish("zara01".to_owned(), plan, grid, laser, 0, PatrolParams::default(), 0)?;
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

fn plan() -> Plan {
    Plan {
        layout: Layout {
            outline: rectangle(-9.5, 3.5, 9.0, 21.5),
            masonry: vec![rectangle(-10.5, 3.5, -9.4, 21.5), rectangle(8.9, 3.5, 10.0, 21.5)],
            furniture: vec![
                polygon(&[(-9.5, 11.5), (-5.0, 11.5), (-5.0, 7.0), (-7.0, 6.5), (-9.5, 6.5)]),
                polygon(&[
                    (0.7, 17.1),
                    (0.7, 16.0),
                    (1.4, 15.9),
                    (2.1, 14.8),
                    (2.0, 7.1),
                    (2.5, 6.7),
                    (4.2, 6.4),
                    (4.2, 17.1),
                ]),
            ],
        },
        start: Pose2::new(-8.3, 14.2, 0.0),
        goal: Point2::new(6.0, 19.4),
        routes: Vec::new(),
        crowds: Vec::new(),
        description: "Recorded street (UCY zara01): the robot crosses the flow of people.",
    }
}
