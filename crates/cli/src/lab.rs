//! The commands of the feature `lab`: experiments.

#[cfg(feature = "recording")]
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

#[cfg(feature = "recording")]
use anyhow::bail;
use clap::Subcommand;
use curionav_lab::{bench, localize, scale, tune};
use curionav_runtime::exit::Exit;

#[derive(Debug, Subcommand)]
pub(crate) enum LabCommand {
    Bench(bench::Options),
    Tune(tune::Options),
    /// Take runs from standard input and answer each with a row (started by `bench` and `tune`).
    #[command(hide = true)]
    Worker {
        /// Digest of the program, as it shall be in every row.
        #[arg(long)]
        program: String,
    },
    Scale(scale::Options),
    Localize(localize::Options),
}

pub(crate) async fn run(command: LabCommand, log: &str) -> Result<u8, Exit> {
    match command {
        LabCommand::Bench(options) => bench::bench(options).await,
        LabCommand::Tune(options) => tune::tune(options).await,
        LabCommand::Worker { program } => bench::worker(&program).await,
        LabCommand::Scale(options) => scale::scale(options, log).await,
        LabCommand::Localize(options) => localize::localize(&options, &recorded),
    }
}

/// What a recording holds of a robot, for `localize`.
#[cfg(not(feature = "recording"))]
fn recorded(_: &Path, _: Option<&str>) -> anyhow::Result<localize::Recorded> {
    anyhow::bail!("{}", crate::left_out::left_out("recording").line())
}

/// What a recording holds of a robot, for `localize`.
#[cfg(feature = "recording")]
fn recorded(path: &Path, robot: Option<&str>) -> anyhow::Result<localize::Recorded> {
    use curionav_recording::{Item, Reader};
    let (mut found, mut robots) = (localize::Recorded::default(), BTreeSet::new());
    let (mut maps, mut map, mut first_run) = (BTreeMap::new(), None, None);
    let mut reader = Reader::open(path)?;
    while let Some(item) = reader.next_message()? {
        let is_wanted = |name: &str| robot.is_none_or(|robot| robot == name);
        match item {
            Item::Scan(name, scan) if is_wanted(&name) => {
                robots.insert(name);
                found.scans.push(*scan);
            }
            Item::Odometry(name, odometry) if is_wanted(&name) => found.odometry.push(odometry),
            Item::Belief(name, belief) if is_wanted(&name) => found.beliefs.push(*belief),
            Item::Mission(mission) if is_wanted(&mission.order.robot) => {
                map = map.or(Some(mission.order.map))
            }
            Item::Map(map) => {
                maps.insert(map.map, map);
            }
            // What a later run or another world came to says nothing of this one.
            Item::Run(run) => {
                let id = (run.world.clone(), run.run);
                if *first_run.get_or_insert_with(|| id.clone()) == id {
                    found.result = run.result;
                }
            }
            _ => {}
        }
    }
    let path = path.display();
    if robots.is_empty() {
        let whose = robot.map_or_else(|| "any robot".to_owned(), |robot| format!("robot {robot}"));
        bail!("{path}: it has no scan of {whose}");
    }
    if robots.len() > 1 {
        let robots = Vec::from_iter(robots).join(", ");
        bail!("{path} holds several robots, name one with --robot: {robots}");
    }
    found.map = map.and_then(|map| maps.remove(&map));
    Ok(found)
}
