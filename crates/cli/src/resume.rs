//! `curionav resume`: a paused robot goes on.

use clap::Args;
use curionav_runtime::exit::Exit;
use curionav_schemas::MissionCommand;

use crate::mission_request::{RobotOptions, send};

/// Let a paused robot go on.
#[derive(Debug, Args)]
pub(crate) struct ResumeOptions {
    #[command(flatten)]
    of: RobotOptions,
}

pub(crate) async fn run(options: ResumeOptions) -> Result<u8, Exit> {
    send(&options.of.robot, &options.of.at, MissionCommand::Resume).await
}
