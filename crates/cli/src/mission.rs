//! `curionav goal`, `cancel`, `pause`, `stop` and `resume`: a robot is sent elsewhere, or made to stand.

use std::time::Duration;

use anyhow::{Error, anyhow};
use clap::{Args, Subcommand};
use curionav_runtime::command::Commander;
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::print::print;
use curionav_runtime::query::AskError;
use curionav_runtime::session;
use curionav_runtime::topic::Inbox;
use curionav_schemas::keys::Commanded;
use curionav_schemas::{Mission, MissionCommand, Odometry, keys};
use curionav_security::table::Verb;
use zenoh::Session;

use crate::connect::{ConnectOptions, OPERATES, commands_as};
use crate::goal;

const TIMEOUT: Duration = Duration::from_secs(3);
/// Any robot brakes within it.
const STOP_TIMEOUT: Duration = Duration::from_secs(10);
/// A robot that is slower than this stands, m/s and rad/s.
const STANDING: f64 = 0.02;

#[derive(Debug, Subcommand)]
pub(crate) enum MissionRequest {
    /// Send a robot to another goal, and say whether its services take it.
    ///
    /// Exit status: 0 taken; 1 refused, with the reason; 2 bad argument; 3 no router or no driver.
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
    /// Pause a robot until `resume`: in whatever state its mission is, and if it has none.
    Pause(RobotOptions),
    /// Pause a robot, and wait until it stands.
    Stop(RobotOptions),
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
    match request {
        MissionRequest::Goal { robot, x, y, yaw: heading, at } => {
            goal::check(x, y, heading)?;
            command(&RobotOptions { robot, at }, &MissionCommand::Goal { x, y, heading, way: None }).await
        }
        MissionRequest::Cancel(options) => command(&options, &MissionCommand::Cancel).await,
        MissionRequest::Pause(options) => halt(&options, Halt::Pause).await,
        MissionRequest::Stop(options) => halt(&options, Halt::Stop).await,
        MissionRequest::Resume(options) => halt(&options, Halt::Resume).await,
    }
}

/// A session over which this kind of command may be given to the robot, and the one who gives it.
async fn commander(options: &RobotOptions, kind: Commanded) -> Result<(Session, Commander), Exit> {
    let RobotOptions { robot, at } = options;
    keys::check_id(robot).map_err(|error| Exit::bad_input(Error::from(error).context("robot")))?;
    let config = at.config(&OPERATES, Some(robot))?;
    let by = commands_as(&config, "operator");
    let key = kind.by(robot, &by).map_err(Exit::bad_input)?;
    at.require(&config, &OPERATES, Verb::Ask, &key)?;
    let session = session::client(&config).await?;
    let commander = Commander::new(&session, robot, &by);
    Ok((session, commander))
}

/// Gives a command to the driver that drives the robot.
async fn command(options: &RobotOptions, command: &MissionCommand) -> Result<u8, Exit> {
    let robot = &options.robot;
    let (session, commander) = commander(options, Commanded::Mission).await?;
    let mut answer = commander.command_to_holder(command, TIMEOUT).await;
    if let (MissionCommand::Goal { .. }, Ok(mission)) = (command, &answer) {
        answer = Ok(goal::settled(&session, mission.clone()).await);
    }
    session::close(&session);
    let mission = answer.map_err(|error| match error {
        AskError::Rejected(reject) => Exit::failed(Error::from(reject).context(robot.clone())),
        error => Exit::network(Error::from(error).context(format!("no driver of robot `{robot}` answered"))),
    })?;
    if matches!(command, MissionCommand::Goal { .. }) {
        goal::accepted(&mission)?;
    }
    print(format_args!("{robot}: mission {}", standing(&mission)))?;
    Ok(SUCCESS)
}

/// What becomes of a robot without a command of its mission.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Halt {
    Pause,
    Stop,
    Resume,
}

async fn halt(options: &RobotOptions, halt: Halt) -> Result<u8, Exit> {
    let robot = &options.robot;
    let (session, commander) = commander(options, Commanded::Pause).await?;
    let outcome = halted(&session, &commander, robot, halt).await;
    session::close(&session);
    print(format_args!("{robot}: {}", outcome?))?;
    Ok(SUCCESS)
}

/// Pauses a robot or lets it go on; says what it does then.
async fn halted(session: &Session, commander: &Commander, robot: &str, halt: Halt) -> Result<String, Exit> {
    // Before it brakes: so that nothing that it says is missed.
    let odometry = keys::robot(robot, "odom").map(|key| Inbox::<Odometry>::new(session, &key));
    let odometry = odometry.map_err(Exit::bad_input)?.map_err(Exit::network)?;
    let paused = halt != Halt::Resume;
    let reached = commander.pause(paused, TIMEOUT).await.map_err(|error| {
        let error = Error::from(error);
        Exit::network(error.context(format!("neither a base nor a driver of robot `{robot}` answered")))
    })?;
    if !reached.is_complete() {
        let missing = if reached.base.is_some() {
            "the base has obeyed, but the driver that holds its lease does not answer"
        } else {
            "drivers have obeyed, but no base of the robot answers"
        };
        return Err(Exit::network(anyhow!("robot `{robot}`: {missing}")));
    }
    let driver =
        reached.driver.map_or("no driver".to_owned(), |driver| format!("driver `{}`", driver.instance));
    match halt {
        Halt::Resume => Ok(format!("goes on, {driver}")),
        Halt::Pause => Ok(format!("paused, {driver}")),
        Halt::Stop => stands(&odometry).await.map(|()| format!("paused and stands, {driver}")),
    }
}

/// Waits until odometry says that the robot stands; a robot without odometry is not taken to.
async fn stands(odometry: &Inbox<Odometry>) -> Result<(), Exit> {
    let slow = async {
        while let Some(said) = odometry.next().await {
            if said.v.abs() < STANDING && said.omega.abs() < STANDING {
                return;
            }
        }
    };
    tokio::time::timeout(STOP_TIMEOUT, slow).await.map_err(|_| {
        Exit::failed(anyhow!(
            "paused, but within {} s no odometry says that the robot stands",
            STOP_TIMEOUT.as_secs()
        ))
    })
}

pub(crate) fn standing(mission: &Mission) -> String {
    let revision = mission.revision;
    let state = mission.state.name();
    let order = &mission.order;
    format!("revision {revision}, {state}, goal ({:.2}, {:.2})", order.goal_x, order.goal_y)
}
