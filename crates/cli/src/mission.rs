//! `curionav goal`, `pause`, `resume` and `cancel`: a robot's driver is asked to change its mission.

use std::time::Duration;

use anyhow::{Error, anyhow};
use clap::{Args, Subcommand};
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::print::print;
use curionav_runtime::query::{AskError, Urgency, ask};
use curionav_runtime::session;
use curionav_schemas::{Mission, MissionCommand, keys};
use curionav_security::table::Verb;

use crate::connect::{ConnectOptions, OPERATES};

const TIMEOUT: Duration = Duration::from_secs(3);

#[derive(Debug, Subcommand)]
pub(crate) enum MissionRequest {
    /// Send a robot to another goal.
    Goal {
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
    },
    /// Stop a robot until `resume`.
    Pause(RobotOptions),
    /// Let a paused robot go on.
    Resume(RobotOptions),
    /// End a robot's mission.
    Cancel(RobotOptions),
}

#[derive(Debug, Args)]
pub(crate) struct RobotOptions {
    /// Robot's name.
    robot: String,
    #[command(flatten)]
    at: ConnectOptions,
}

pub(crate) async fn run(request: MissionRequest) -> Result<u8, Exit> {
    let (RobotOptions { robot, at }, command) = match request {
        MissionRequest::Goal { robot, x, y, yaw: heading, at } => {
            if ![x, y, heading.unwrap_or_default()].into_iter().all(f64::is_finite) {
                return Err(Exit::bad_input(anyhow!("x, y and yaw must be finite numbers")));
            }
            (RobotOptions { robot, at }, MissionCommand::Goal { x, y, heading })
        }
        MissionRequest::Pause(options) => (options, MissionCommand::Pause),
        MissionRequest::Resume(options) => (options, MissionCommand::Resume),
        MissionRequest::Cancel(options) => (options, MissionCommand::Cancel),
    };
    let key = keys::mission_command(&robot).map_err(|e| Exit::bad_input(Error::from(e).context("robot")))?;
    at.require(&OPERATES, Verb::Ask, &key)?;
    let session = at.session(&OPERATES).await?;
    let answer: Result<Mission, AskError> = ask(&session, &key, &command, TIMEOUT, Urgency::Normal).await;
    session::close(&session);
    let mission = answer.map_err(|error| match error {
        AskError::Rejected(reject) => Exit::failed(Error::from(reject).context(robot.clone())),
        error => Exit::network(Error::from(error).context(format!("no driver of robot `{robot}` answered"))),
    })?;
    print(format_args!("{robot}: mission {}", standing(&mission)))?;
    Ok(SUCCESS)
}

pub(crate) fn standing(mission: &Mission) -> String {
    let revision = mission.revision;
    let state = mission.state.name();
    let order = &mission.order;
    format!("revision {revision}, {state}, goal ({:.2}, {:.2})", order.goal_x, order.goal_y)
}
