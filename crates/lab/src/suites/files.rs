//! What all suites are made of: crowds, regions and files.

use curionav_crowdsim::Scenario;
use curionav_crowdsim::scenario::{Behaviour, Crowd, Region};
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::{MapYaml, OccupancyGrid, encode_pgm};
use curionav_planning::random::{Rng, uniform};

/// Path below `scenarios/`, and content.
pub type File = (String, Vec<u8>);

/// Speeds at which people walk, m/s: those of nearly all pedestrians (Weidmann, 1993: 1.34 m/s, deviation 0.26).
const SPEED: [f64; 2] = [0.8, 1.6];
/// The chance of a person to take no notice of the robot, and to walk on until its body stops one.
const HEEDLESS: f64 = 0.2;
/// Sizes of groups that walk side by side. Larger ones do not walk in a line (Moussaid and others, 2010).
const GROUP: [u32; 2] = [2, 3];
/// Of so many people who walk, one walks in a group.
const ONE_IN_A_GROUP: u32 = 3;

/// A crowd of people who walk, as two: those who walk in groups, and those who walk alone. Groups are drawn first,
/// while there is room for them.
pub(super) fn in_company(crowd: Crowd) -> Vec<Crowd> {
    let grouped = crowd.count / ONE_IN_A_GROUP;
    if grouped < GROUP[0] {
        return vec![crowd];
    }
    let groups = Crowd { count: grouped, group: GROUP, ..crowd.clone() };
    vec![groups, Crowd { count: crowd.count - grouped, ..crowd }]
}

/// People who walk alone between two places anywhere on the floor.
pub(super) fn walking(count: usize) -> Crowd {
    Crowd {
        count: count as u32,
        behaviour: Behaviour::Walk,
        regions: Vec::new(),
        places: 2,
        stretch_m: [4.0, 10.0],
        speed: SPEED,
        pause_s: [0.0, 0.0],
        group: [1, 1],
        apart_m: 1.5,
        heedless: HEEDLESS,
    }
}

/// A number between two, metres or radians.
pub(super) fn between(least: f64, most: f64, random: &mut Rng) -> f64 {
    least + (most - least).max(0.0) * uniform(random)
}

pub(super) fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Vec<Point2> {
    [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| Point2::new(x, y)).to_vec()
}

pub(super) fn region(x0: f64, y0: f64, x1: f64, y1: f64) -> Region {
    Region { corners: rectangle(x0, y0, x1, y1) }
}

pub(super) fn scenario_file(folder: &str, scenario: &Scenario) -> anyhow::Result<File> {
    let header = "# Written by `curionav scenario generate`; edit crates/lab/src/suites instead.\n";
    let text = format!("{header}{}", scenario.to_toml()?);
    Ok((format!("{folder}/{}.toml", scenario.name), text.into_bytes()))
}

pub(super) fn map_files(folder: &str, name: &str, grid: &OccupancyGrid) -> anyhow::Result<[File; 2]> {
    let image = format!("{name}.pgm");
    let yaml = MapYaml::trinary(grid, &image).to_text()?;
    Ok([
        (format!("{folder}/maps/{name}.yaml"), yaml.into_bytes()),
        (format!("{folder}/maps/{image}"), encode_pgm(grid)),
    ])
}
