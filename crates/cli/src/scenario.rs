//! `curionav scenario`: checking and generating scenario files.

use std::path::Path;

use anyhow::Context;
use curionav_schemas::Clock;

use crate::arguments::ScenarioCommand;
use crate::exit::{Exit, SUCCESS};
use crate::package::{self, Choice};

pub(crate) fn scenario(command: ScenarioCommand) -> Result<u8, Exit> {
    match command {
        ScenarioCommand::Check { files } => {
            for file in &files {
                check(file).map_err(Exit::bad_input)?;
            }
        }
        ScenarioCommand::Generate { out } => generate(&out).map_err(Exit::bad_input)?,
    }
    Ok(SUCCESS)
}

fn check(file: &Path) -> anyhow::Result<()> {
    let package = package::read(file, &Choice::default(), Clock::Lockstep, 1.0)?;
    let prepared = curionav_simulator::prepare(&package.request, "robot")
        .map_err(|e| package.fault(Some(&e.field), &e.problem))?;
    let scenario = prepared.world.scenario();
    #[expect(clippy::print_stdout, reason = "what the command is for")]
    {
        println!(
            "{}: fine; {} x {} cells of {} m, {} walkers, {} recordings, planner {}",
            file.display(),
            prepared.map.width,
            prepared.map.height,
            prepared.map.resolution,
            scenario.walkers.len(),
            scenario.recorded.len(),
            prepared.profile.name
        );
    }
    Ok(())
}

fn generate(out: &Path) -> anyhow::Result<()> {
    for (name, bytes) in Vec::<(String, Vec<u8>)>::new() {
        let path = out.join(name);
        if let Some(directory) = path.parent() {
            std::fs::create_dir_all(directory)
                .with_context(|| format!("cannot create {}", directory.display()))?;
        }
        std::fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
        #[expect(clippy::print_stdout, reason = "what the command is for")]
        {
            println!("{}", path.display());
        }
    }
    Ok(())
}
