//! Asking a robot's driver to change its mission.

use std::time::Duration;

use clap::Args;
use curionav_runtime::query::{AskError, Urgency, ask};
use curionav_runtime::session;
use curionav_schemas::{Mission, MissionCommand, keys};

use crate::connect::ConnectOptions;
use curionav_runtime::exit::{Exit, SUCCESS};

const TIMEOUT: Duration = Duration::from_secs(3);

/// The robot that is meant.
#[derive(Debug, Args)]
pub(crate) struct RobotOptions {
    /// Robot's name.
    pub(crate) robot: String,
    #[command(flatten)]
    pub(crate) at: ConnectOptions,
}

/// Sends `request` and prints what the mission is afterwards.
pub(crate) async fn send(robot: &str, at: &ConnectOptions, request: MissionCommand) -> Result<u8, Exit> {
    let key =
        keys::mission_command(robot).map_err(|e| Exit::bad_input(anyhow::Error::from(e).context("robot")))?;
    let session = session::client(&at.config()).await.map_err(|e| Exit::network(e.into()))?;
    let answer: Result<Mission, AskError> = ask(&session, &key, &request, TIMEOUT, Urgency::Normal).await;
    session::close(&session);
    match answer {
        Ok(mission) => {
            #[expect(clippy::print_stdout, reason = "what the command is for")]
            {
                println!(
                    "{robot}: mission revision {}, {}, goal ({:.2}, {:.2})",
                    mission.revision,
                    mission.state.name(),
                    mission.order.goal_x,
                    mission.order.goal_y
                );
            }
            Ok(SUCCESS)
        }
        Err(AskError::Rejected(reject)) => {
            Err(Exit::failed(anyhow::Error::from(reject).context(robot.to_owned())))
        }
        Err(error) => Err(Exit::network(
            anyhow::Error::from(error).context(format!("no driver of robot `{robot}` answered")),
        )),
    }
}
