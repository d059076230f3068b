//! `curionav run`: a scenario from file to measures.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::Context;
use clap::Args;
use curionav_deployment::files;
use curionav_picture::{Run, run_svg};
use curionav_runtime::command::Commander;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::print::print;
use curionav_runtime::session;
use curionav_runtime::shutdown::on_signals;
use curionav_schemas::{Clock, MissionCommand, keys};
use curionav_security::table::Verb;
use zenoh::Session;

use crate::connect::{ConnectOptions, EXPERIMENTS, commands_as};
use crate::output;
use crate::recording;
use crate::things::things;
use curionav_deployment::embedded::Embedded;
use curionav_deployment::follow::{Finished, follow};
use curionav_deployment::package::{self, Choice, Package, Perception};
use curionav_own_planner::Source;
use curionav_runtime::exit::Exit;

const STATUS_TIMEOUT: Duration = Duration::from_secs(2);
/// Attempts to cancel, and the time between them.
const CANCEL_ATTEMPTS: u32 = 5;
const CANCEL_RETRY: Duration = Duration::from_millis(100);
/// Reports have the lowest priority: they may arrive this long after the end of the run.
const LAST_REPORTS: Duration = Duration::from_millis(500);

/// Run a scenario and show its measures.
///
/// The services run inside this program, unless --connect or --secure names a running deployment.
#[derive(Debug, Args)]
pub(crate) struct RunOptions {
    /// Scenario file, or the built-in `quickstart`.
    #[arg(value_name = "SCENARIO.toml")]
    scenario: PathBuf,
    /// Planner: a built-in profile, a profile file (.toml), or a planner of one's own: a name in a Python file
    /// (mine.py:policy) or a program (./planner). In a deployment `curionav planner` serves the latter. Default: the
    /// scenario's.
    #[arg(long, value_name = "PROFILE")]
    planner: Option<String>,
    /// How people are known: truth, robot-frame (the truth as seen from the robot), tracked (by the service tracker,
    /// from the laser) or tracked-all-round (the same with a laser that sees all around). Default: as the scenario
    /// says.
    #[arg(long, value_name = "HOW")]
    perception: Option<Perception>,
    /// Seed of everything random: start error, odometry, laser, localiser, generator.
    #[arg(long, value_name = "N", default_value_t = 1)]
    seed: u64,
    /// max (lockstep: as fast as the machine allows and repeatable to the bit), realtime, or simulated seconds per
    /// second.
    #[arg(long, value_name = "max|realtime|X", default_value = "max", value_parser = parse_speed)]
    speed: (Clock, f64),
    /// Write metrics.json, trajectory.csv, cycles.csv and run.svg into this directory.
    #[arg(long, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Print exactly one JSON object on standard output.
    #[arg(long)]
    json: bool,
    /// Record the run into this file, as `curionav record` does.
    #[arg(long, value_name = "OUT.mcap")]
    record: Option<PathBuf>,
    #[command(flatten)]
    at: ConnectOptions,
    /// World of the deployment's simulator.
    #[arg(long, value_name = "NAME", default_value = "world")]
    world: String,
    /// Robot of the deployment.
    #[arg(long, value_name = "NAME", default_value = "robot")]
    robot: String,
}

impl RunOptions {
    /// Whether the robot's clock waits for its services.
    pub(crate) fn is_lockstep(&self) -> bool {
        self.speed.0 == Clock::Lockstep
    }
}

/// The clock, and simulated seconds per second of the wall clock.
pub(crate) fn parse_speed(text: &str) -> Result<(Clock, f64), String> {
    match (text, text.parse::<f64>()) {
        ("max", _) => Ok((Clock::Lockstep, 1.0)),
        ("realtime", _) => Ok((Clock::Realtime, 1.0)),
        (_, Ok(factor)) if factor > 0.0 && factor <= 100.0 => Ok((Clock::Realtime, factor)),
        _ => Err("must be max, realtime, or a factor above 0 and up to 100".into()),
    }
}

pub(crate) async fn run(options: RunOptions) -> Result<u8, Exit> {
    let (clock, time_scale) = options.speed;
    let choice = Choice {
        planner: options.planner.clone(),
        seed: Some(options.seed),
        perception: options.perception,
        ..Choice::default()
    };
    let package = package::read(&options.scenario, &choice, clock, time_scale).map_err(Exit::bad_input)?;
    if let Some(out) = &options.out {
        files::writable_folder(out).context("--out").map_err(Exit::bad_input)?;
    }
    let at = &options.at;
    let is_embedded = at.connect.is_none() && at.secure.is_none();
    if is_embedded && at.namespace.is_some() {
        return Err(Exit::bad_input(anyhow::anyhow!(
            "--namespace needs a running deployment; add --connect or --secure"
        )));
    }
    let of_deployment = if is_embedded { ServiceConfig::default() } else { at.config(&EXPERIMENTS, None)? };
    if !is_embedded {
        let key = keys::world(&options.world, "scenario").map_err(Exit::bad_input)?;
        at.require(&of_deployment, &EXPERIMENTS, Verb::Ask, &key)?;
    }
    let config =
        ServiceConfig { robot: options.robot.clone(), world: options.world.clone(), ..of_deployment };
    config.check().map_err(Exit::bad_input)?;
    let (finished, recording) = if !is_embedded {
        let session = session::client(&config).await?;
        let finished = recorded(&session, &config, &package, &options).await;
        session::close(&session);
        finished?
    } else {
        let planner = options.planner.clone().filter(|it| matches!(Source::parse(it), Ok(Some(_))));
        let config = ServiceConfig { takes_turns: options.is_lockstep(), planner, ..config };
        let mut embedded = Embedded::start(&config).await.map_err(Exit::network)?;
        let session = embedded.session.clone();
        let finished = tokio::select! {
            finished = recorded(&session, &config, &package, &options) => finished,
            failure = embedded.failure() => Err(Exit::network(failure)),
        };
        embedded.stop().await;
        finished?
    };
    // A run has taken place whatever became of its recording.
    let status = show(options.out.as_deref(), options.json, &package, finished)?;
    recording.map(|()| status)
}

/// Writes the run into `out`, prints it as a table or as JSON, and only then fails if it could not be written.
pub(crate) fn show(
    out: Option<&Path>,
    as_json: bool,
    package: &Package,
    finished: Finished,
) -> Result<u8, Exit> {
    let Finished { result, reports, map } = finished;
    let truth = package.truth().map_err(Exit::bad_input)?;
    let truth = truth.as_ref().map(convert::occupancy_grid_to_wire);
    let written = out.map(|directory| {
        let robot = &package.scenario.robot;
        let picture = map.map(|map| {
            run_svg(&Run {
                result: &result,
                reports: &reports,
                map: &map,
                truth: truth.as_ref(),
                things: &things(package),
                goal: (robot.goal.x, robot.goal.y),
                robot_radius: robot.model.radius(),
                goal_tolerance: robot.goal_tolerance,
            })
        });
        output::write(directory, &result, &reports, picture).map(|()| directory.display())
    });
    let json = output::json(&result).map_err(Exit::failed);
    print(if as_json { json? } else { output::table(&result) })?;
    if let Some(directory) = written.transpose()?.filter(|_| !as_json) {
        print(format_args!("Picture: {directory}/run.svg, with data beside it"))?;
    }
    Ok(output::exit_code(&result))
}

/// Follows the run, and records it if that is wanted: also gives what became of the recording.
async fn recorded(
    session: &Session,
    config: &ServiceConfig,
    package: &Package,
    options: &RunOptions,
) -> Result<(Finished, Result<(), Exit>), Exit> {
    let Some(path) = &options.record else {
        return Ok((follow_or_cancel(session, config, package, options.out.is_some()).await?, Ok(())));
    };
    recording::during(session, path, config, async {
        let finished = follow_or_cancel(session, config, package, options.out.is_some()).await;
        // What has been decided may still be on its way, last in line.
        if !config.connect.is_empty() {
            tokio::time::sleep(LAST_REPORTS).await;
        }
        finished
    })
    .await
}

/// Follows the run to its end, and cancels it if this program is interrupted.
pub(crate) async fn follow_or_cancel(
    session: &Session,
    config: &ServiceConfig,
    package: &Package,
    keep_reports: bool,
) -> Result<Finished, Exit> {
    let mut signals = on_signals().map_err(Exit::network)?;
    tokio::select! {
        finished = follow(session, config, package, keep_reports) => finished,
        () = signals.requested() => {
            cancel(&Commander::new(session, &config.robot, &commands_as(config, "experimenter"))).await;
            Err(Exit::failed(anyhow::anyhow!("interrupted; the mission is cancelled")))
        }
    }
}

/// Cancels the mission; an injection that is still being checked has none yet, so it is tried again.
async fn cancel(commander: &Commander) {
    for _ in 0..CANCEL_ATTEMPTS {
        match commander.command_to_holder(&MissionCommand::Cancel, STATUS_TIMEOUT).await {
            Ok(_) => return,
            Err(error) => tracing::warn!(%error, "the mission could not be cancelled"),
        }
        tokio::time::sleep(CANCEL_RETRY).await;
    }
}
