//! `curionav run`: a scenario from file to metrics.

use std::time::Duration;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::query::{AskError, Urgency, ask, fetch};
use curionav_runtime::session;
use curionav_runtime::shutdown::on_signals;
use curionav_runtime::topic::Inbox;
use curionav_schemas::{
    Clock, CycleReport, Mission, MissionRequest, OccupancyGrid, RejectCode, RunResult, RunState, RunStatus,
    keys,
};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use zenoh::Session;

use crate::arguments::{RunOptions, Speed};
use crate::embedded::Embedded;
use crate::exit::Exit;
use crate::output;
use crate::package::{self, Choice, Package};
use crate::record;

/// The simulator answers an injection once it has checked everything.
const INJECT_TIMEOUT: Duration = Duration::from_secs(30);
/// Without news for this long the status is asked for.
const NEWS_TIMEOUT: Duration = Duration::from_secs(2);
/// A status is small and kept.
const STATUS_TIMEOUT: Duration = Duration::from_secs(2);
/// Attempts to cancel, and the time between them.
const CANCEL_ATTEMPTS: u32 = 5;
const CANCEL_RETRY: Duration = Duration::from_millis(100);
/// Reports have the lowest priority: they may arrive this long after the end of the run.
const LAST_REPORTS: Duration = Duration::from_millis(500);
/// Questions about the status that may fail in a row before the simulator is given up.
const STATUS_ATTEMPTS: u32 = 5;

pub(crate) async fn run(options: RunOptions) -> Result<u8, Exit> {
    let (clock, time_scale) = match options.speed {
        Speed::Max => (Clock::Lockstep, 1.0),
        Speed::Factor(factor) => (Clock::Realtime, factor),
    };
    let choice = Choice { planner: options.planner.clone(), seed: Some(options.seed) };
    let package = package::read(&options.scenario, &choice, clock, time_scale).map_err(Exit::bad_input)?;
    let config = ServiceConfig {
        connect: options.connect.iter().cloned().collect(),
        namespace: options.namespace.clone(),
        robot: options.robot.clone(),
        world: options.world.clone(),
        ..ServiceConfig::default()
    };
    config.check().map_err(Exit::bad_input)?;
    let (finished, recording) = if options.connect.is_some() {
        let session = session::client(&config).await.map_err(|e| Exit::network(e.into()))?;
        let finished = recorded(&session, &config, &package, &options).await;
        session::close(&session);
        finished?
    } else {
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
    let status = show(&options, &package, &finished)?;
    recording.map(|()| status)
}

/// What is left of a run.
pub(crate) struct Finished {
    pub(crate) result: RunResult,
    /// Every cycle, in order, and where it took place, if they were kept.
    pub(crate) reports: Vec<CycleReport>,
    pub(crate) map: Option<OccupancyGrid>,
}

fn show(options: &RunOptions, package: &Package, finished: &Finished) -> Result<u8, Exit> {
    let result = &finished.result;
    if let (Some(directory), Some(map)) = (&options.out, &finished.map) {
        let robot = &package.scenario.robot;
        let goal = (robot.goal.x, robot.goal.y);
        output::write(
            directory,
            result,
            &finished.reports,
            map,
            goal,
            robot.model.radius(),
            robot.goal_tolerance,
        )
        .map_err(Exit::failed)?;
    }
    #[expect(clippy::print_stdout, reason = "what the command is for")]
    if options.json {
        println!("{}", output::json(result).map_err(|e| Exit::failed(e.into()))?);
    } else {
        println!("{}", output::table(result));
        if let (Some(directory), Some(_)) = (&options.out, &finished.map) {
            println!("Picture and data: {}", directory.display());
        }
    }
    Ok(output::exit_code(result))
}

/// Follows the run, and records it if that is wanted: also gives what became of the recording.
async fn recorded(
    session: &Session,
    config: &ServiceConfig,
    package: &Package,
    options: &RunOptions,
) -> Result<(Finished, Result<(), Exit>), Exit> {
    let Some(path) = &options.record else {
        return Ok((follow_or_cancel(session, config, package, options).await?, Ok(())));
    };
    let recorder = record::of_run(session, path, config)?;
    let finished = follow_or_cancel(session, config, package, options).await;
    // What has been decided may still be on its way, last in line.
    if options.connect.is_some() {
        tokio::time::sleep(LAST_REPORTS).await;
    }
    let recording = recorder.finish().await;
    let recording = recording.map(|tally| eprintln!("{}", record::summary(path, &tally)));
    let recording = recording.map_err(Exit::failed);
    match finished {
        Ok(finished) => Ok((finished, recording)),
        Err(exit) => {
            // The program ends with what became of the run.
            if let Err(error) = recording {
                tracing::error!(%error, "the recording failed as well");
            }
            Err(exit)
        }
    }
}

async fn follow_or_cancel(
    session: &Session,
    config: &ServiceConfig,
    package: &Package,
    options: &RunOptions,
) -> Result<Finished, Exit> {
    let mission_key = keys::robot(&config.robot, "mission").map_err(|e| Exit::bad_input(e.into()))?;
    let mut signals = on_signals().map_err(|e| Exit::network(e.into()))?;
    tokio::select! {
        finished = follow(session, config, package, options.out.is_some()) => finished,
        () = signals.requested() => {
            cancel(session, &mission_key).await;
            Err(Exit::failed(anyhow::anyhow!("interrupted; the mission is cancelled")))
        }
    }
}

/// Cancels the mission; an injection that is still being checked has none yet, so it is tried again.
async fn cancel(session: &Session, mission_key: &str) {
    for _ in 0..CANCEL_ATTEMPTS {
        let cancelled: Result<Mission, _> =
            ask(session, mission_key, &MissionRequest::Cancel, STATUS_TIMEOUT, Urgency::Normal).await;
        match cancelled {
            Ok(_) => return,
            Err(error) => tracing::warn!(%error, "the mission could not be cancelled"),
        }
        tokio::time::sleep(CANCEL_RETRY).await;
    }
}

/// Injects the scenario and waits for its end; `keep_reports` also gathers what a picture needs.
pub(crate) async fn follow(
    session: &Session,
    config: &ServiceConfig,
    package: &Package,
    keep_reports: bool,
) -> Result<Finished, Exit> {
    let key = |channel| keys::world(&config.world, channel).map_err(|e| Exit::bad_input(e.into()));
    let (run_key, scenario_key) = (key("run")?, key("scenario")?);
    let topic = |e: curionav_runtime::topic::TopicError| Exit::network(e.into());
    let news = Inbox::<RunStatus>::new(session, &run_key).map_err(topic)?;
    let report_key = keys::robot(&config.robot, "report").map_err(|e| Exit::bad_input(e.into()))?;
    let reports = match keep_reports {
        true => Some(Inbox::<CycleReport>::new(session, &report_key).map_err(topic)?),
        false => None,
    };
    let injected: Result<RunStatus, AskError> =
        ask(session, &scenario_key, &package.request, INJECT_TIMEOUT, Urgency::Normal).await;
    let injected = injected.map_err(|error| injection_error(error, package, &config.world))?;
    let bar = progress_bar(package.scenario.clock.time_limit_s);
    let mut kept = Vec::new();
    let status = loop {
        if let Some(reports) = &reports {
            kept.extend(std::iter::from_fn(|| reports.try_next()));
        }
        let status = next_status(session, &run_key, &news, injected.run).await?;
        bar.set_position((status.time_s * 10.0) as u64);
        bar.set_message(match status.state {
            RunState::Preparing => "preparing".to_owned(),
            _ => format!("{:5.1} s simulated, {:5.1} m to go", status.time_s, status.distance_to_goal),
        });
        if matches!(status.state, RunState::Finished | RunState::Failed) {
            break status;
        }
    };
    bar.finish_and_clear();
    if let Some(reports) = &reports {
        kept.extend(std::iter::from_fn(|| reports.try_next()));
    }
    let Some(result) = status.result else {
        let reason = status.error.unwrap_or_else(|| "the run ended without a result".into());
        return Err(Exit::network(anyhow::anyhow!("the run failed: {reason}")));
    };
    let map = match (kept.first(), keep_reports) {
        (Some(report), _) => fetch(session, &keys::map(&report.map), INJECT_TIMEOUT)
            .await
            .map_err(|error| tracing::error!(%error, "no map for the picture: nothing is written"))
            .ok(),
        (None, true) => {
            tracing::error!("no cycle report came: nothing is written");
            None
        }
        (None, false) => None,
    };
    Ok(Finished { result, reports: kept, map })
}

fn injection_error(error: AskError, package: &Package, world: &str) -> Exit {
    match error {
        AskError::Rejected(reject) if reject.code == RejectCode::Overloaded => Exit::network(reject.into()),
        AskError::Rejected(reject) => Exit::bad_input(package.fault(reject.field.as_deref(), &reject.reason)),
        error => Exit::network(
            anyhow::Error::from(error).context(format!("no simulator of world `{world}` takes the scenario")),
        ),
    }
}

/// The next status of run `run`: published, or asked for when no news come.
async fn next_status(
    session: &Session,
    key: &str,
    news: &Inbox<RunStatus>,
    run: u64,
) -> Result<RunStatus, Exit> {
    let lost = |reason: String| Exit::network(anyhow::anyhow!("the simulator is lost: {reason}"));
    let mut attempts = 0;
    loop {
        match tokio::time::timeout(NEWS_TIMEOUT, news.next()).await {
            Ok(Some(status)) if status.run == run => return Ok(status),
            Ok(Some(_)) => {}
            Ok(None) => return Err(lost("the session is closed".into())),
            Err(_) => match fetch::<RunStatus>(session, key, STATUS_TIMEOUT).await {
                Ok(status) if status.run == run => return Ok(status),
                Ok(_) => return Err(lost("it was started anew".into())),
                Err(error) if attempts == STATUS_ATTEMPTS => return Err(lost(error.to_string())),
                Err(_) => attempts += 1,
            },
        }
    }
}

fn progress_bar(limit_s: f64) -> ProgressBar {
    // Hidden by itself when standard error is not a terminal.
    let bar = ProgressBar::with_draw_target(Some((limit_s * 10.0) as u64), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template("{elapsed_precise} {wide_bar} {msg}") {
        bar.set_style(style);
    }
    bar
}
