//! A worker process: all services of one robot, kept for many runs so that the fields of a map are made once.
//!
//! Standard input takes one job a line, standard output answers one line each: a row, or why there is none. The end
//! of standard input is the end of the process, so that no worker outlives the process that started it.

use std::time::Instant;

use curionav_runtime::config::ServiceConfig;
use curionav_schemas::{Clock, Message};
use serde::{Deserialize, Serialize};
use tokio::sync::mpsc;

use super::own_planner::OwnPlanners;
use super::plan::{Job, digest, key};
use super::row::{Row, way};
use curionav_deployment::embedded::Embedded;
use curionav_deployment::files;
use curionav_deployment::follow::follow;
use curionav_deployment::package::{self, Choice};
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::print::print;

#[derive(Debug, Serialize, Deserialize)]
pub(super) struct Refusal {
    pub(super) error: String,
}

/// Answers jobs until standard input ends; `program` is the digest of this program for the rows.
pub async fn worker(program: &str) -> Result<u8, Exit> {
    let config = ServiceConfig { takes_turns: true, ..ServiceConfig::default() };
    let mut embedded = Embedded::start(&config).await.map_err(Exit::network)?;
    let mut jobs = jobs();
    let mut own = OwnPlanners::new();
    while let Some(line) = jobs.recv().await {
        let session = embedded.session.clone();
        let row = tokio::select! {
            row = run(&session, &config, program, &line, &mut own) => row,
            failure = embedded.failure() => Err(Exit::network(failure)),
        };
        let answer = match row {
            Ok(row) => serde_json::to_string(&row),
            Err(exit) => serde_json::to_string(&Refusal { error: exit.line() }),
        };
        print(answer.map_err(Exit::failed)?)?;
    }
    Ok(SUCCESS)
}

/// The lines of standard input, read on a thread of their own: during a run, too, their end ends the process.
fn jobs() -> mpsc::Receiver<String> {
    let (sender, jobs) = mpsc::channel(1);
    std::thread::spawn(move || {
        for line in std::io::stdin().lines() {
            let Ok(line) = line else { break };
            if sender.blocking_send(line).is_err() {
                return;
            }
        }
        // Nothing waits for an answer any more: there is nothing to save.
        std::process::exit(0);
    });
    jobs
}

async fn run(
    session: &zenoh::Session,
    config: &ServiceConfig,
    program: &str,
    line: &str,
    own: &mut OwnPlanners,
) -> Result<Row, Exit> {
    let job: Job = serde_json::from_str(line).map_err(Exit::bad_input)?;
    let begin = Instant::now();
    let planner = Some(job.planner_source.clone());
    let perception = job.perception;
    let profile = own.profile(&job.planner_source).map_err(Exit::bad_input)?;
    let is_own = profile.is_some();
    let choice = Choice { planner, profile, perception, ..Choice::default() };
    let mut package =
        package::read(&job.scenario_file, &choice, Clock::Lockstep, 1.0).map_err(Exit::bad_input)?;
    if key(&digest(&package), job.seed) != job.key {
        let changed = "the scenario, a file it names or the profile changed since the start";
        return Err(Exit::bad_input(anyhow::anyhow!("{}: {changed}", job.scenario_file.display())));
    }
    package.request.seed = Some(job.seed);
    let (result, tally) = if is_own {
        let (result, tally) = own.play(&job.planner_source, &package).map_err(Exit::failed)?;
        (result, Some(tally))
    } else {
        (follow(session, config, &package, false).await?.result, None)
    };
    let row = Row {
        key: job.key,
        program: program.to_owned(),
        scenario: job.scenario,
        planner: job.planner,
        seed: job.seed,
        outcome: result.outcome,
        measures: result.measures.clone(),
        contacts: result.contacts.clone(),
        social: result.social.clone(),
        cycles: result.cycles.clone(),
        decisions_sha256: result.decisions_sha256.clone(),
        real_time_factor: result.real_time_factor,
        wall_s: begin.elapsed().as_secs_f64(),
        way: way(&result),
        own_planner: tally,
    };
    if let Some(path) = &job.trace {
        files::write(path, result.encode()).map_err(Exit::bad_input)?;
    }
    Ok(row)
}
