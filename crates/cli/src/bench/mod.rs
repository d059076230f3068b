//! `curionav bench`: all planners in all scenarios with all seeds, and what came out.
//!
//! Read in this order: [`plan`] (what has to be run), [`pool`] and [`worker`] (how), [`journal`] (what is kept),
//! `comparison` (what it means), `acceptance` (whether that is what was hoped for), `report`.

mod journal;
mod metric;
mod plan;
mod pool;
mod progress;
mod published;
mod results;
mod row;
mod statistics;
mod worker;

use std::path::Path;

use anyhow::Context;
use curionav_runtime::shutdown::{Shutdown, on_signals};

use crate::arguments::BenchOptions;
use crate::exit::{Exit, FAILED, SUCCESS};
use journal::Journal;
use plan::{Job, Plan};
use pool::{Done, Interrupted, Pool};
use progress::Progress;
use row::Row;

pub(crate) use worker::worker;

/// A run that could not take place.
pub(crate) struct Missing {
    pub(crate) job: Job,
    pub(crate) reason: String,
}

pub(crate) async fn bench(options: BenchOptions) -> Result<u8, Exit> {
    let plan = Plan::read(&options.planners, &options.scenarios).map_err(Exit::bad_input)?;
    let traces = options.out.join("traces");
    std::fs::create_dir_all(&traces)
        .with_context(|| format!("--out: cannot create {}", traces.display()))
        .map_err(Exit::bad_input)?;
    let program = plan::program_digest().map_err(Exit::failed)?;
    let mut journal = Journal::open(&options.out.join("journal.jsonl"), &program, options.any_build)
        .map_err(Exit::bad_input)?;
    let pool = Pool { jobs: workers(options.jobs), program };
    let jobs = plan.jobs(options.first_seed, options.repeats, Some(&traces));
    let mut shutdown = on_signals().map_err(|e| Exit::network(e.into()))?;
    let missing = finish(&pool, &mut journal, &jobs, &mut shutdown).await.map_err(|error| {
        if error.is::<Interrupted>() {
            let kept = jobs.iter().filter(|job| journal.row(&job.key).is_some()).count();
            let kept = format!("{kept} of {} runs are kept in {}", jobs.len(), options.out.display());
            Exit::failed(anyhow::anyhow!("interrupted; {kept}: the same command goes on"))
        } else {
            Exit::failed(error)
        }
    })?;
    let rows: Vec<&Row> = jobs.iter().filter_map(|job| journal.row(&job.key)).collect();
    write(
        &options.out,
        &[("results.csv", results::results(&rows)), ("timings.csv", results::timings(&rows))],
    )
    .map_err(Exit::failed)?;
    for Missing { job, reason } in &missing {
        tracing::error!("{}, {}, seed {}: {reason}", job.scenario, job.planner, job.seed);
    }
    Ok(if missing.is_empty() { SUCCESS } else { FAILED })
}

fn workers(wanted: Option<u16>) -> usize {
    let cores = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    wanted.map_or_else(cores, usize::from)
}

/// Runs what the journal does not have yet; gives what could not run.
pub(crate) async fn finish(
    pool: &Pool,
    journal: &mut Journal,
    jobs: &[Job],
    shutdown: &mut Shutdown,
) -> anyhow::Result<Vec<Missing>> {
    let is_kept =
        |job: &Job| journal.row(&job.key).is_some() && job.trace.as_deref().is_none_or(Path::is_file);
    let open: Vec<Job> = jobs.iter().filter(|job| !is_kept(job)).cloned().collect();
    let mut progress = Progress::new(open.len());
    let mut missing = Vec::new();
    let ran = pool.run(open, shutdown, |done| {
        match done {
            Done::Row(row, line) => {
                progress.step(&format!("last {}, {}, seed {}", row.scenario, row.planner, row.seed));
                journal.add(&line, *row)?;
            }
            Done::Failed(job, reason) => {
                progress.step("one failed");
                missing.push(Missing { job, reason });
            }
        }
        Ok(())
    });
    let ran = ran.await;
    progress.finish();
    ran?;
    missing.sort_by_key(|m| jobs.iter().position(|job| job.key == m.job.key));
    Ok(missing)
}

fn write(folder: &Path, files: &[(&str, String)]) -> anyhow::Result<()> {
    for (name, content) in files {
        let path = folder.join(name);
        std::fs::write(&path, content).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}
