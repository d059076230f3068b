//! `curionav scenario`: checking and generating scenario files.

use std::path::Path;

use anyhow::Context;
use curionav_crowdsim::paper;
use curionav_schemas::Clock;

use crate::arguments::ScenarioCommand;
use crate::exit::{Exit, SUCCESS};
use crate::package::{self, Choice};
use crate::picture::scene_svg;
use curionav_simulator::Prepared;

pub(crate) fn scenario(command: ScenarioCommand) -> Result<u8, Exit> {
    match command {
        ScenarioCommand::Check { files } => {
            for file in &files {
                check(file).map_err(Exit::bad_input)?;
            }
        }
        ScenarioCommand::Draw { files, out } => {
            for file in &files {
                draw(file, &out).map_err(Exit::bad_input)?;
            }
        }
        ScenarioCommand::Generate { out } => generate(&out).map_err(Exit::bad_input)?,
    }
    Ok(SUCCESS)
}

/// A scenario as it would be run.
fn prepared(file: &Path) -> anyhow::Result<Prepared> {
    let package = package::read(file, &Choice::default(), Clock::Lockstep, 1.0)?;
    curionav_simulator::prepare(&package.request, "robot")
        .map_err(|e| package.fault(Some(&e.field), &e.problem))
}

fn draw(file: &Path, out: &Path) -> anyhow::Result<()> {
    let prepared = prepared(file)?;
    std::fs::create_dir_all(out).with_context(|| format!("cannot create {}", out.display()))?;
    let name = file.file_stem().with_context(|| format!("{} is not a file", file.display()))?;
    let path = out.join(name).with_extension("svg");
    std::fs::write(&path, scene_svg(&prepared.world, &prepared.map))
        .with_context(|| format!("cannot write {}", path.display()))
}

fn check(file: &Path) -> anyhow::Result<()> {
    let prepared = prepared(file)?;
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

/// The scenes are drawn from a fixed seed, so that what is written is what is committed.
fn generate(out: &Path) -> anyhow::Result<()> {
    for (name, bytes) in paper::committed()? {
        let path = out.join(name);
        if let Some(parent) = path.parent() {
            std::fs::create_dir_all(parent).with_context(|| format!("cannot create {}", parent.display()))?;
        }
        std::fs::write(&path, bytes).with_context(|| format!("cannot write {}", path.display()))?;
    }
    // What the drawn scenes turned out to be like, for whoever changes the drawing.
    for scene in paper::environments(paper::SEED)?.into_iter().chain([paper::quickstart(paper::SEED)?]) {
        #[expect(clippy::print_stdout, reason = "what the command is for")]
        {
            println!("{}\n{}", scene.scenario.name, paper::check(&scene));
        }
    }
    Ok(())
}
