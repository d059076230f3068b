//! The commands for experiments.

use clap::Subcommand;
use curionav_lab::{bench, localize, map_build, scale, track, tune};
use curionav_runtime::exit::Exit;

use crate::recording::recorded;

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
    Track(track::Options),
    /// Make maps
    #[command(subcommand)]
    Map(MapCommand),
}

#[derive(Debug, Subcommand)]
pub(crate) enum MapCommand {
    Build(map_build::Options),
}

pub(crate) async fn run(command: LabCommand, log: &str) -> Result<u8, Exit> {
    match command {
        LabCommand::Bench(options) => bench::bench(options).await,
        LabCommand::Tune(options) => tune::tune(options).await,
        LabCommand::Worker { program } => bench::worker(&program).await,
        LabCommand::Scale(options) => scale::scale(options, log).await,
        LabCommand::Localize(options) => localize::localize(&options, &recorded),
        LabCommand::Track(options) => track::track(&options, &recorded),
        LabCommand::Map(MapCommand::Build(options)) => map_build::build(&options),
    }
}
