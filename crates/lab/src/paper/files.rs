//! A scene as the files a repository holds: scenario TOML, `map_server` YAML and binary PGM.

use curionav_planning::occupancy::{MapYaml, encode_pgm};

use super::scene::PaperScene;
use super::{SEED, environments, quickstart, zara01};

/// Everything the generator writes below `scenarios/`: (path, content), in a fixed order.
pub fn committed() -> anyhow::Result<Vec<(String, Vec<u8>)>> {
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
fn files(scene: &PaperScene) -> anyhow::Result<Vec<(String, Vec<u8>)>> {
    let name = &scene.scenario.name;
    let header =
        "# Written by `curionav scenario generate`; edit the drawing in crates/lab/src/paper instead.\n";
    let scenario = format!("{header}{}", scene.scenario.to_toml()?);
    let image = format!("{name}.pgm");
    let yaml = MapYaml::trinary(&scene.map.grid, &image).to_text()?;
    Ok(vec![
        (format!("{name}.toml"), scenario.into_bytes()),
        (format!("maps/{name}.yaml"), yaml.into_bytes()),
        (format!("maps/{image}"), encode_pgm(&scene.map.grid)),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_crowdsim::Scenario;

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
            scenario.check_on(&scene.map).unwrap();
        }
    }
}
