//! `curionav pause`: a robot stops until `resume`.

use clap::Args;
use curionav_runtime::exit::Exit;
use curionav_schemas::MissionCommand;

use crate::mission_request::{RobotOptions, send};

/// Stop a robot until `resume`.
#[derive(Debug, Args)]
pub(crate) struct PauseOptions {
    #[command(flatten)]
    of: RobotOptions,
}

pub(crate) async fn run(options: PauseOptions) -> Result<u8, Exit> {
    send(&options.of.robot, &options.of.at, MissionCommand::Pause).await
}
