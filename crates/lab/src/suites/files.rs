//! What all suites are made of: crowds, regions and files.

use curionav_crowdsim::Scenario;
use curionav_crowdsim::scenario::{Behaviour, Crowd, Region};
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::{MapYaml, OccupancyGrid, encode_pgm};
use curionav_planning::random::{Rng, uniform};

/// Path below `scenarios/`, and content.
pub type File = (String, Vec<u8>);

/// People who walk between two places anywhere on the floor, at the speeds of the paper's (A31).
pub(super) fn walking(count: usize) -> Crowd {
    Crowd {
        count: count as u32,
        behaviour: Behaviour::Walk,
        regions: Vec::new(),
        places: 2,
        stretch_m: [4.0, 10.0],
        speed: [0.3, 1.0],
        pause_s: [0.0, 0.0],
        group: [1, 1],
        apart_m: 1.5,
        heedless: 0.0,
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
