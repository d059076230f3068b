//! `curionav goal`: another goal.

use clap::Args;
use curionav_runtime::exit::Exit;
use curionav_schemas::MissionCommand;

use crate::connect::ConnectOptions;
use crate::mission_request::send;

/// Send a robot to another goal.
#[derive(Debug, Args)]
pub(crate) struct GoalOptions {
    /// Robot's name.
    robot: String,
    /// Metres, map frame.
    #[arg(allow_negative_numbers = true)]
    x: f64,
    /// Metres, map frame.
    #[arg(allow_negative_numbers = true)]
    y: f64,
    /// Radians, map frame.
    #[arg(allow_negative_numbers = true)]
    yaw: Option<f64>,
    #[command(flatten)]
    at: ConnectOptions,
}

pub(crate) async fn run(options: GoalOptions) -> Result<u8, Exit> {
    let (x, y, heading) = (options.x, options.y, options.yaw);
    if ![Some(x), Some(y), heading].into_iter().flatten().all(f64::is_finite) {
        return Err(Exit::bad_input(anyhow::anyhow!("a goal needs finite numbers")));
    }
    send(&options.robot, &options.at, MissionCommand::Goal { x, y, heading }).await
}
