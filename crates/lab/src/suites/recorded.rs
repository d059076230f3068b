//! People as they were filmed. They do not see the robot.

use curionav_crowdsim::scenario::{Recorded, RecordingFormat};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::sensor::LaserModel;

use super::files::{File, map_files, rectangle, scenario_file};
use crate::paper::{Layout, OWN_CELL_M, rounded, task};

/// Range of the laser, metres: a common one of a service robot.
const RANGE_M: f64 = 8.0;

/// (recording, map, last second at which a run may begin, tasks: name, description, start, goal). The recordings take
/// 360 and 215 s.
type Street = (&'static str, &'static str, f64, [(&'static str, &'static str, Pose2, Point2); 3]);

fn streets() -> [Street; 2] {
    // In both recordings nine tenths of the way is walked along y, as much north as south.
    let north = std::f64::consts::FRAC_PI_2;
    let [a, b, c] = [(-3.5, 5.0), (-3.5, 20.0), (6.0, 19.4)].map(|(x, y)| Point2::new(x, y));
    let [d, e, f] = [(0.5, -9.5), (0.5, 11.0), (11.0, 1.0)].map(|(x, y)| Point2::new(x, y));
    let from = |p: Point2, heading| Pose2::new(p.x, p.y, rounded(heading));
    [
        (
            "zara01",
            "../real/maps/zara01.yaml",
            300.0,
            [
                ("north", "Along a street", from(a, north), b),
                ("south", "Along a street, the other way", from(b, -north), a),
                ("across", "Across a street", Pose2::new(-8.3, 14.2, 0.0), c),
            ],
        ),
        (
            "students03",
            "maps/students03.yaml",
            155.0,
            [
                ("north", "Along the main flow of a campus", from(d, north), e),
                ("south", "Along the main flow of a campus, the other way", from(e, -north), d),
                ("across", "Across the main flow of a campus", Pose2::new(-9.5, 1.0, 0.0), f),
            ],
        ),
    ]
}

pub(super) fn files() -> anyhow::Result<Vec<File>> {
    let mut files = Vec::new();
    // The recording has no map. Walls 3 m around the filmed area hold the pose; people come and go inside of them.
    let campus = Layout {
        outline: rectangle(-11.0, -11.0, 12.5, 12.5),
        masonry: vec![rectangle(-12.0, -12.0, 13.5, 13.5)],
        furniture: vec![],
    };
    files.extend(map_files("recorded", "students03", &campus.grid(OWN_CELL_M, None)?)?);
    for (recording, map, last_start_s, tasks) in streets() {
        for (way, description, start, goal) in tasks {
            let name = format!("{recording}-{way}");
            let description = format!("{description} (UCY {recording}), from a second that the seed draws.");
            let mut scenario = task(&name, &description, map, start, goal);
            scenario.laser = LaserModel { range_max: RANGE_M, ..LaserModel::default() };
            scenario.clock.time_limit_s = 90.0;
            scenario.recorded = vec![Recorded {
                file: format!("dataset:peds_eth_ucy/{recording}/obsmat.txt"),
                format: RecordingFormat::Obsmat,
                fps: 25.0,
                start_s: 0.0,
                start_until_s: Some(last_start_s),
                pose: Pose2::default(),
                ids: None,
                r#loop: false,
            }];
            files.push(scenario_file("recorded", &scenario)?);
        }
    }
    Ok(files)
}
