//! Talking to a robot's mission key.

use std::time::Duration;

use curionav_runtime::query::{AskError, Urgency, ask};
use curionav_runtime::session;
use curionav_schemas::{Mission, MissionRequest, keys};

use crate::arguments::{ConnectOptions, GoalOptions, RobotOptions};
use crate::exit::{Exit, SUCCESS};

const TIMEOUT: Duration = Duration::from_secs(3);

pub(crate) async fn goal(options: GoalOptions) -> Result<u8, Exit> {
    let (x, y, heading) = (options.x, options.y, options.yaw);
    if ![Some(x), Some(y), heading].into_iter().flatten().all(f64::is_finite) {
        return Err(Exit::bad_input(anyhow::anyhow!("a goal needs finite numbers")));
    }
    tell(&options.robot, &options.at, MissionRequest::Goal { x, y, heading }).await
}

pub(crate) async fn pause(options: RobotOptions) -> Result<u8, Exit> {
    tell(&options.robot, &options.at, MissionRequest::Pause).await
}

pub(crate) async fn resume(options: RobotOptions) -> Result<u8, Exit> {
    tell(&options.robot, &options.at, MissionRequest::Resume).await
}

pub(crate) async fn cancel(options: RobotOptions) -> Result<u8, Exit> {
    tell(&options.robot, &options.at, MissionRequest::Cancel).await
}

async fn tell(robot: &str, at: &ConnectOptions, request: MissionRequest) -> Result<u8, Exit> {
    let key = keys::robot(robot, "mission")
        .map_err(|e| Exit::bad_input(anyhow::Error::from(e).context("robot")))?;
    let session = session::client(&at.config()).await.map_err(|e| Exit::network(e.into()))?;
    let answer: Result<Mission, AskError> = ask(&session, &key, &request, TIMEOUT, Urgency::Normal).await;
    session::close(&session);
    match answer {
        Ok(mission) => {
            #[expect(clippy::print_stdout, reason = "what the command is for")]
            {
                println!(
                    "{robot}: mission revision {}, {}, goal ({:.2}, {:.2})",
                    mission.revision, mission.state, mission.goal_x, mission.goal_y
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
