//! Plays a scenario file in this thread, and prints how it ended.
//!
//! `cargo run --release -p curionav-in-process --example play -- scenarios/quickstart.toml curionav 1`

#![expect(clippy::print_stdout, reason = "an example prints what it finds")]

use std::collections::BTreeMap;
use std::error::Error;
use std::path::Path;

use curionav_crowdsim::Scenario;
use curionav_in_process::{play, prepare};
use curionav_mission::convert;
use curionav_mission::fields::Fields;
use curionav_planning::occupancy::MapYaml;
use curionav_planning::profile::Profile;
use curionav_schemas::{Clock, InjectRequest};

type Files = BTreeMap<String, Vec<u8>>;

/// The last part of a path, under which a file is sent.
fn name_of(file: &str) -> String {
    file.rsplit('/').next().unwrap_or(file).to_owned()
}

/// Adds a map's description and its image; gives the description's name.
fn add_map(folder: &Path, file: &str, files: &mut Files) -> Result<String, Box<dyn Error>> {
    let path = folder.join(file);
    let description = std::fs::read(&path)?;
    let image = MapYaml::parse(std::str::from_utf8(&description)?)?.image;
    files.insert(name_of(&image), std::fs::read(path.with_file_name(&image))?);
    files.insert(name_of(file), description);
    Ok(name_of(file))
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut arguments = std::env::args().skip(1);
    let file = arguments.next().unwrap_or_else(|| "scenarios/quickstart.toml".into());
    let planner = arguments.next();
    let seed = arguments.next().map(|seed| seed.parse()).transpose()?;
    let folder = Path::new(&file).parent().unwrap_or(Path::new(""));
    let mut scenario = Scenario::from_toml(&std::fs::read_to_string(&file)?)?;
    let mut files = Files::new();
    scenario.map.file = add_map(folder, &scenario.map.file, &mut files)?;
    if let Some(truth) = &scenario.world.file {
        scenario.world.file = Some(add_map(folder, truth, &mut files)?);
    }
    let planner = planner.unwrap_or_else(|| scenario.planner.profile.clone());
    let mut profile = Profile::builtin(&planner).ok_or("give a built-in planner")?;
    if let Some(overrides) = scenario.profile.take() {
        profile = profile.with_overrides(&overrides)?;
    }
    let request = InjectRequest {
        scenario: convert::to_value(&scenario)?,
        files: files.into_iter().map(|(name, bytes)| (name, bytes.into())).collect(),
        profile: convert::to_value(&profile)?,
        seed,
        clock: Clock::Lockstep,
        time_scale: 1.0,
    };
    let fields = Fields::of_maps([]);
    let result = play(prepare(&request, "robot", &fields)?, &fields).map_err(|end| format!("{end:?}"))?;
    println!("{} {:?} {}", result.planner, result.outcome, result.decisions_sha256);
    println!("{:?}", result.measures);
    Ok(())
}
