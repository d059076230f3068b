//! A scenario played by services that run already: it is injected and followed to its end.

use std::fmt::Display;
use std::time::Duration;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::exit::Exit;
use curionav_runtime::map_store;
use curionav_runtime::query::{AskError, Urgency, ask, fetch};
use curionav_runtime::topic::Inbox;
use curionav_schemas::{CycleReport, OccupancyGrid, RunResult, RunState, RunStatus, keys, words};
use indicatif::{ProgressBar, ProgressDrawTarget, ProgressStyle};
use tokio::time::{Instant, timeout_at};
use zenoh::Session;

use crate::package::Package;

/// The simulator answers an injection once it has checked everything.
const INJECT_TIMEOUT: Duration = Duration::from_secs(30);
/// Without news for this long the status is asked for.
const NEWS_TIMEOUT: Duration = Duration::from_secs(2);
/// A status is small and kept.
const STATUS_TIMEOUT: Duration = Duration::from_secs(2);
/// Questions about the status that may fail in a row before the simulator is given up.
const STATUS_ATTEMPTS: u32 = 5;

/// The reports of the last cycles come within it.
const LAST_REPORTS: Duration = Duration::from_secs(1);

/// What is left of a run.
pub struct Finished {
    /// How it went.
    pub result: RunResult,
    /// Every planning cycle, in order, if they were kept.
    pub reports: Vec<CycleReport>,
    /// Where it took place. The first cycle that was kept says so; without one there is only the reason.
    pub map: Result<OccupancyGrid, Exit>,
}

/// Injects the scenario and waits for its end; `keep_reports` also gathers what a picture needs.
///
/// # Errors
/// Bad input if the simulator refuses the scenario, the network if it cannot be reached or is lost.
pub async fn follow(
    session: &Session,
    config: &ServiceConfig,
    package: &Package,
    keep_reports: bool,
) -> Result<Finished, Exit> {
    let run_key = keys::world(&config.world, "run").map_err(Exit::bad_input)?;
    let scenario_key = keys::world(&config.world, "scenario").map_err(Exit::bad_input)?;
    let news = Inbox::<RunStatus>::new(session, &run_key).map_err(Exit::network)?;
    let report_key = keys::robot(&config.robot, "report").map_err(Exit::bad_input)?;
    let reports = keep_reports.then(|| Inbox::<CycleReport>::new(session, &report_key));
    let reports = reports.transpose().map_err(Exit::network)?;
    let arrived = || reports.iter().flat_map(|inbox| std::iter::from_fn(|| inbox.try_next()));
    let injected: Result<RunStatus, AskError> =
        ask(session, &scenario_key, &package.request, INJECT_TIMEOUT, Urgency::Normal).await;
    let injected = injected.map_err(|error| injection_error(error, package, &config.world))?;
    let limit_s = package.scenario.clock.time_limit_s;
    let bar = progress_bar((limit_s * 10.0) as u64, "{elapsed_precise} {wide_bar} {msg}");
    let mut kept = Vec::new();
    let status = loop {
        kept.extend(arrived());
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
    kept.extend(arrived());
    if let (Some(inbox), Some(result)) = (&reports, &status.result) {
        await_last(inbox, &mut kept, result.cycles.count as usize).await;
    }
    let Some(result) = status.result else {
        let reason = status.error.map(|end| words::say("end", &end));
        let reason = reason.unwrap_or_else(|| "it ended without a result".into());
        return Err(Exit::network(anyhow::anyhow!("the run failed: {reason}")));
    };
    let map = match kept.first() {
        Some(report) => map_store::fetch(session, report.map, INJECT_TIMEOUT)
            .await
            .map(|map| convert::occupancy_grid_to_wire(&map))
            .map_err(|error| Exit::network(anyhow::Error::from(error).context("the run's map did not come"))),
        None => Err(Exit::failed(package.fault(None, "no planning cycle was reported"))),
    };
    Ok(Finished { result, reports: kept, map })
}

/// Waits for the reports of a run that has ended until there are `cycles` of them: what is said of the run overtakes
/// what is said of its last cycles. In real time reports may be lost.
async fn await_last(inbox: &Inbox<CycleReport>, kept: &mut Vec<CycleReport>, cycles: usize) {
    let deadline = Instant::now() + LAST_REPORTS;
    while kept.len() < cycles {
        match timeout_at(deadline, inbox.next()).await {
            Ok(Some(report)) => kept.push(report),
            _ => return,
        }
    }
}

fn injection_error(error: AskError, package: &Package, world: &str) -> Exit {
    match error {
        AskError::Rejected(reject) if reject.why.is_transient() => Exit::network(reject),
        AskError::Rejected(reject) => Exit::bad_input(package.refusal(&reject)),
        error => Exit::network(
            anyhow::Error::from(error).context(format!("no simulator of world `{world}` takes the scenario")),
        ),
    }
}

/// The next status of run `run`: published, or asked for when no news of it come, whatever comes of other runs.
async fn next_status(
    session: &Session,
    key: &str,
    news: &Inbox<RunStatus>,
    run: u64,
) -> Result<RunStatus, Exit> {
    let mut attempts = 0;
    let mut deadline = Instant::now() + NEWS_TIMEOUT;
    loop {
        match timeout_at(deadline, news.next()).await {
            Ok(Some(status)) if status.run == run => return Ok(status),
            Ok(Some(_)) => {}
            Ok(None) => return Err(lost("the session is closed")),
            Err(_) => match fetch::<RunStatus>(session, key, STATUS_TIMEOUT).await {
                Ok(status) if status.run == run => return Ok(status),
                Ok(_) => return Err(lost("it was started anew")),
                Err(error) if attempts == STATUS_ATTEMPTS => return Err(lost(error)),
                Err(_) => {
                    attempts += 1;
                    deadline = Instant::now() + NEWS_TIMEOUT;
                }
            },
        }
    }
}

fn lost(reason: impl Display) -> Exit {
    Exit::network(anyhow::anyhow!("the simulator is lost: {reason}"))
}

/// A bar on standard error, `template` as of indicatif. It hides by itself where there is no terminal.
pub fn progress_bar(length: u64, template: &str) -> ProgressBar {
    let bar = ProgressBar::with_draw_target(Some(length), ProgressDrawTarget::stderr());
    if let Ok(style) = ProgressStyle::with_template(template) {
        bar.set_style(style);
    }
    bar
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use curionav_runtime::exit::{BAD_INPUT, NO_NETWORK};
    use curionav_schemas::{Clock, Refusal};

    use super::*;
    use crate::package::{self, Choice};

    #[test]
    fn a_refusal_that_may_pass_is_no_bad_input() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../scenarios/quickstart.toml");
        let package = package::read(&file, &Choice::default(), Clock::Lockstep, 1.0).unwrap();
        let status = |why: Refusal| injection_error(AskError::Rejected(why.into()), &package, "world").code;
        assert_eq!((status(Refusal::Busy), status(Refusal::Overloaded)), (NO_NETWORK, NO_NETWORK));
        assert_eq!(status(Refusal::invalid("it is wrong")), BAD_INPUT);
    }
}
