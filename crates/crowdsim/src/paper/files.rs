//! A scene as the files a repository holds: scenario TOML, `map_server` YAML and binary PGM.

use curionav_planning::occupancy::{Cell, OccupancyGrid};

use super::{PaperScene, SEED, SceneError, environments, quickstart, zara01};

/// Everything the generator writes below `scenarios/`: (path, content), in a fixed order.
pub fn committed() -> Result<Vec<(String, Vec<u8>)>, SceneError> {
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
pub fn files(scene: &PaperScene) -> Result<Vec<(String, Vec<u8>)>, SceneError> {
    let name = &scene.scenario.name;
    let header =
        "# Written by `curionav scenario generate`; edit the drawing in crates/crowdsim/src/paper instead.\n";
    let scenario = format!("{header}{}", scene.scenario.to_toml()?);
    Ok(vec![
        (format!("{name}.toml"), scenario.into_bytes()),
        (format!("maps/{name}.yaml"), yaml(&scene.map.grid, name).into_bytes()),
        (format!("maps/{name}.pgm"), pgm(&scene.map.grid)),
    ])
}

fn yaml(grid: &OccupancyGrid, name: &str) -> String {
    let origin = grid.origin();
    format!(
        "image: {name}.pgm\nresolution: {}\norigin: [{}, {}, {}]\nnegate: 0\noccupied_thresh: 0.65\nfree_thresh: 0.196\n",
        grid.resolution(),
        decimal(origin.x),
        decimal(origin.y),
        decimal(origin.heading)
    )
}

/// Always with a decimal point, so that every YAML reader takes it for a float.
fn decimal(number: f64) -> String {
    format!("{number:?}")
}

/// `map_server`'s greys: 254 free, 0 occupied, 205 unknown. Row 0 of the picture is the top.
fn pgm(grid: &OccupancyGrid) -> Vec<u8> {
    let mut bytes = format!("P5\n{} {}\n255\n", grid.width(), grid.height()).into_bytes();
    for row in (0..grid.height()).rev() {
        bytes.extend((0..grid.width()).map(|column| match grid.cell(grid.index(column, row)) {
            Cell::Free => 254,
            Cell::Occupied => 0,
            Cell::Unknown => 205,
        }));
    }
    bytes
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Pose2;

    use super::*;
    use crate::Scenario;

    #[test]
    fn the_committed_files_are_what_the_generator_writes() {
        let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../../scenarios");
        for (path, bytes) in committed().unwrap() {
            let found = std::fs::read(format!("{folder}/{path}")).unwrap();
            assert!(found == bytes, "{path} differs; run `curionav scenario generate scenarios`");
        }
    }

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
            scenario.check(&scene.map).unwrap();
        }
    }

    #[test]
    fn the_picture_starts_with_the_top_row() {
        let grid = OccupancyGrid::new(2, 2, 0.5, Pose2::new(-1.0, 0.25, 0.0), vec![0, 100, -1, 0]).unwrap();
        assert_eq!(pgm(&grid), b"P5\n2 2\n255\n\xcd\xfe\xfe\x00");
        assert!(yaml(&grid, "m").contains("origin: [-1.0, 0.25, 0.0]"));
    }
}
