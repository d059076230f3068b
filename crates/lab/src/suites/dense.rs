//! Four places at four densities, without a free lane, for people of either law of avoiding.

use curionav_crowdsim::scenario::{Crowd, Motion, Region};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::Cell;
use curionav_planning::sensor::LaserModel;

use super::files::{File, in_company, map_files, rectangle, region, scenario_file, walking};
use crate::paper::{Layout, OWN_CELL_M, Polygon, task};

/// People per square metre of floor.
const DENSITIES: [f64; 4] = [0.1, 0.2, 0.4, 0.8];
/// Range of the laser, metres: a common one of a service robot.
const RANGE_M: f64 = 8.0;

/// A place where streams of people meet.
struct Place {
    name: &'static str,
    description: &'static str,
    outline: Polygon,
    furniture: Vec<Polygon>,
    start: Pose2,
    goal: Point2,
    /// Regions that people walk between, one list per stream; none: anywhere.
    streams: Vec<Vec<Region>>,
}

fn places() -> [Place; 4] {
    let corners = |list: &[(f64, f64)]| list.iter().map(|&(x, y)| Point2::new(x, y)).collect();
    [
        Place {
            name: "corridor",
            description: "Along a corridor 4 m wide with people in both directions",
            outline: rectangle(0.0, 0.0, 24.0, 4.0),
            furniture: vec![],
            start: Pose2::new(1.5, 2.0, 0.0),
            goal: Point2::new(22.0, 2.0),
            streams: vec![vec![region(0.0, 0.0, 4.0, 4.0), region(20.0, 0.0, 24.0, 4.0)]],
        },
        Place {
            name: "crossing",
            description: "Over the crossing of two corridors 4 m wide with people in all directions",
            outline: corners(&[
                (0.0, 10.0),
                (10.0, 10.0),
                (10.0, 0.0),
                (14.0, 0.0),
                (14.0, 10.0),
                (24.0, 10.0),
                (24.0, 14.0),
                (14.0, 14.0),
                (14.0, 24.0),
                (10.0, 24.0),
                (10.0, 14.0),
                (0.0, 14.0),
            ]),
            furniture: vec![],
            start: Pose2::new(1.5, 12.0, 0.0),
            goal: Point2::new(22.0, 12.0),
            streams: vec![
                vec![region(0.0, 10.0, 4.0, 14.0), region(20.0, 10.0, 24.0, 14.0)],
                vec![region(10.0, 0.0, 14.0, 4.0), region(10.0, 20.0, 14.0, 24.0)],
            ],
        },
        Place {
            name: "door",
            description: "Through a door 2 m wide that people use in both directions",
            outline: rectangle(0.0, 0.0, 16.0, 8.0),
            furniture: vec![rectangle(7.8, -1.0, 8.2, 3.0), rectangle(7.8, 5.0, 8.2, 9.0)],
            start: Pose2::new(1.5, 4.0, 0.0),
            goal: Point2::new(14.5, 4.0),
            streams: vec![vec![
                region(0.0, 0.0, 6.0, 8.0),
                region(7.5, 3.0, 8.5, 5.0),
                region(10.0, 0.0, 16.0, 8.0),
            ]],
        },
        Place {
            name: "plaza",
            description: "Across a square of 16 m on which people walk in all directions",
            outline: rectangle(0.0, 0.0, 16.0, 16.0),
            furniture: vec![rectangle(4.8, 4.8, 5.2, 5.2), rectangle(10.8, 10.8, 11.2, 11.2)],
            start: Pose2::new(1.5, 8.0, 0.0),
            goal: Point2::new(14.5, 8.0),
            streams: vec![],
        },
    ]
}

pub(super) fn files() -> anyhow::Result<Vec<File>> {
    let mut files = Vec::new();
    for place in places() {
        files.extend(at_densities("dense", place, &DENSITIES)?);
    }
    Ok(files)
}

/// A place with a shape and densities of its own, for tuning.
pub(super) fn training() -> anyhow::Result<Vec<File>> {
    let passage = Place {
        name: "passage",
        description: "Along a passage 6 m wide with kiosks and people in both directions",
        outline: rectangle(0.0, 0.0, 20.0, 6.0),
        furniture: vec![rectangle(6.0, 2.4, 7.2, 3.6), rectangle(13.0, -1.0, 14.0, 1.5)],
        start: Pose2::new(1.5, 3.0, 0.0),
        goal: Point2::new(18.0, 3.0),
        streams: vec![vec![region(0.0, 0.0, 4.0, 6.0), region(16.0, 0.0, 20.0, 6.0)]],
    };
    at_densities("training", passage, &[0.15, 0.3])
}

/// A place with people of each law at each density, in people per square metre.
fn at_densities(folder: &str, place: Place, densities: &[f64]) -> anyhow::Result<Vec<File>> {
    let masonry = vec![rectangle(-2.0, -2.0, 26.0, 26.0)];
    let layout = Layout { outline: place.outline, masonry, furniture: place.furniture };
    let grid = layout.grid(OWN_CELL_M, None)?;
    let free = (0..grid.cells().len()).filter(|&i| grid.cell(i) == Cell::Free).count();
    let area = free as f64 * OWN_CELL_M * OWN_CELL_M;
    let mut files = map_files(folder, place.name, &grid)?.to_vec();
    for (motion, law) in [(Motion::Hrvo, "hrvo"), (Motion::SocialForce, "force")] {
        for density in densities {
            let people = (density * area).round() as usize;
            let name = format!("{}-{law}-{}", place.name, density.to_string().replace('.', ""));
            let description = format!("{}: {density} people per square metre.", place.description);
            let map = format!("maps/{}.yaml", place.name);
            let mut scenario = task(&name, &description, &map, place.start, place.goal);
            scenario.laser = LaserModel { range_max: RANGE_M, ..LaserModel::default() };
            scenario.people.motion = motion;
            let streams = place.streams.len().max(1);
            // Earlier streams take what does not divide.
            let share = |k: usize| people / streams + usize::from(k < people % streams);
            scenario.crowds = match &place.streams[..] {
                [] => in_company(Crowd { places: 4, stretch_m: [3.0, 16.0], ..walking(people) }),
                streams => (streams.iter().enumerate())
                    .flat_map(|(k, regions)| {
                        let regions = regions.clone();
                        in_company(Crowd { regions, stretch_m: [1.0, 30.0], ..walking(share(k)) })
                    })
                    .collect(),
            };
            files.push(scenario_file(folder, &scenario)?);
        }
    }
    Ok(files)
}
