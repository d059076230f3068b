//! `curionav cancel`: a robot's mission ends.

use clap::Args;
use curionav_runtime::exit::Exit;
use curionav_schemas::MissionCommand;

use crate::mission_request::{RobotOptions, send};

/// End a robot's mission.
#[derive(Debug, Args)]
pub(crate) struct CancelOptions {
    #[command(flatten)]
    of: RobotOptions,
}

pub(crate) async fn run(options: CancelOptions) -> Result<u8, Exit> {
    send(&options.of.robot, &options.of.at, MissionCommand::Cancel).await
}
