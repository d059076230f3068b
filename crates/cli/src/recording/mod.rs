//! The commands for recordings: what a recording holds, and what a cycle meant.

mod explain;
mod record;
mod recorded;
mod replay;
mod robots;

use clap::Subcommand;
use curionav_runtime::exit::Exit;

pub(crate) use record::during;
pub(crate) use recorded::recorded;

#[derive(Debug, Subcommand)]
pub(crate) enum RecordingCommand {
    Record(record::RecordOptions),
    Replay(replay::ReplayOptions),
    Explain(explain::ExplainOptions),
}

pub(crate) async fn run(command: RecordingCommand) -> Result<u8, Exit> {
    match command {
        RecordingCommand::Record(options) => record::run(options).await,
        RecordingCommand::Replay(options) => replay::run(options).await,
        RecordingCommand::Explain(options) => explain::run(options).await,
    }
}
