//! People as they were filmed. They do not see the robot.
//!
//! A film is cut into windows. Each is a place of its own, with a start and a goal on floor that filmed people walk on.
//! No second of a film is in two windows, so the windows are as many independent places.

use curionav_crowdsim::scenario::{Recorded, RecordingFormat};
use curionav_planning::geometry::{Point2, Pose2, bearing};
use curionav_planning::sensor::LaserModel;

use super::files::{File, map_files, rectangle, scenario_file};
use crate::paper::{Layout, OWN_CELL_M, rounded, task};

/// Range of the laser, metres: a common one of a service robot.
const RANGE_M: f64 = 8.0;
/// Length of a window, seconds: the time limit of a run, and the moments at which it may begin.
const WINDOW_S: f64 = 50.0;
/// A run begins at a moment within the first seconds of its window, which the seed draws.
const BEGIN_WITHIN_S: f64 = 5.0;

/// A film, and the start and goal of each of its windows, metres. For as long as runs begin, no filmed person comes
/// nearer to the start than 1.2 m.
struct Film {
    name: &'static str,
    map: &'static str,
    description: &'static str,
    tasks: &'static [[(f64, f64); 2]],
}

/// The films take 360 and 215 s.
const FILMS: [Film; 2] = [
    Film {
        name: "zara01",
        map: "../real/maps/zara01.yaml",
        description: "On a street",
        tasks: &[
            [(1.0, 8.0), (-4.0, 20.0)],
            [(-4.5, 17.5), (-0.5, 5.5)],
            [(-3.5, 8.5), (-2.5, 20.5)],
            [(0.0, 20.5), (-3.0, 8.5)],
            [(2.5, 6.0), (0.5, 20.5)],
            [(-0.5, 19.0), (-0.5, 8.0)],
            [(-0.5, 6.0), (-0.5, 18.5)],
        ],
    },
    Film {
        name: "students03",
        map: "maps/students03.yaml",
        description: "On a campus",
        tasks: &[
            [(6.0, -1.0), (-5.5, 5.5)],
            [(-7.0, -5.5), (6.0, 1.0)],
            [(-7.5, 7.5), (-5.5, -5.0)],
            [(6.0, 3.5), (-7.5, -6.0)],
        ],
    },
];

pub(super) fn files() -> anyhow::Result<Vec<File>> {
    let mut files = Vec::new();
    // The recording has no map. Walls 3 m around the filmed area hold the pose; people come and go inside of them.
    let campus = Layout {
        outline: rectangle(-11.0, -11.0, 12.5, 12.5),
        masonry: vec![rectangle(-12.0, -12.0, 13.5, 13.5)],
        furniture: vec![],
    };
    files.extend(map_files("recorded", "students03", &campus.grid(OWN_CELL_M, None)?)?);
    for film in &FILMS {
        for (k, task) in film.tasks.iter().enumerate() {
            files.push(window(film, k, *task)?);
        }
    }
    Ok(files)
}

/// The k-th window of a film.
fn window(film: &Film, k: usize, task_points: [(f64, f64); 2]) -> anyhow::Result<File> {
    let [start, goal] = task_points.map(|(x, y)| Point2::new(x, y));
    let start = Pose2::new(start.x, start.y, rounded(bearing(start, goal)));
    let begin_s = k as f64 * WINDOW_S;
    let name = format!("{}-{}", film.name, k + 1);
    let description =
        format!("{}: {begin_s} to {} s of UCY {}.", film.description, begin_s + WINDOW_S, film.name);
    let mut scenario = task(&name, &description, film.map, start, goal);
    scenario.laser = LaserModel { range_max: RANGE_M, ..LaserModel::default() };
    scenario.clock.time_limit_s = WINDOW_S - BEGIN_WITHIN_S;
    scenario.recorded = vec![Recorded {
        file: format!("dataset:peds_eth_ucy/{}/obsmat.txt", film.name),
        format: RecordingFormat::Obsmat,
        fps: 25.0,
        start_s: begin_s,
        start_until_s: Some(begin_s + BEGIN_WITHIN_S),
        pose: Pose2::default(),
        ids: None,
        r#loop: false,
    }];
    scenario_file("recorded", &scenario)
}
