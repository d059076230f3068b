//! The commands of the feature `lab`: experiments.

mod bench;
mod scale;
mod tune;

use clap::Subcommand;
use curionav_runtime::exit::Exit;

#[derive(Debug, Subcommand)]
pub(crate) enum LabCommand {
    Bench(bench::BenchOptions),
    Tune(tune::TuneOptions),
    #[command(hide = true)]
    Worker(bench::WorkerOptions),
    Scale(scale::ScaleOptions),
}

pub(crate) async fn run(command: LabCommand, log: &str) -> Result<u8, Exit> {
    match command {
        LabCommand::Bench(options) => bench::run(options).await,
        LabCommand::Tune(options) => tune::run(options).await,
        LabCommand::Worker(options) => bench::worker(options).await,
        LabCommand::Scale(options) => scale::run(options, log).await,
    }
}
