//! All planners in all scenarios with all seeds, and what came out.
//!
//! Read in this order: `plan` (what has to be run), `execution`, `worker_process` and [`worker`] (how), `journal`
//! (what is kept), `results` and `manifest` (what is written). `python` hands that to the Python package
//! `curionav.report`, which compares, tests, judges claims and draws.

pub(crate) mod execution;
mod journal;
mod manifest;
pub(crate) mod measure;
mod options;
mod own_planner;
mod places;
pub(crate) mod plan;
mod progress;
mod python;
mod results;
pub(crate) mod row;
mod shards;
mod worker;
mod worker_process;

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use curionav_deployment::files;
use curionav_runtime::exit::{Exit, FAILED, SUCCESS};
use curionav_runtime::print::{note, print};

use execution::Execution;
use manifest::Manifest;
use options::{Command, Results, Shard, What};
use plan::Plan;
use python::Python;
use row::{Row, Tally};
use worker_process::Missing;

pub use options::Options;
pub use worker::worker;

/// Runs what is not in the journal yet, writes all results, and gives the exit status.
///
/// # Errors
/// Bad input if planners, scenarios or the directory cannot be used; failed if interrupted.
pub async fn bench(options: Options) -> Result<u8, Exit> {
    let Options { command, what, shard, jobs: workers, results } = options;
    match command {
        None => finish(&what, &results, shard, workers, &[]).await,
        Some(Command::Merge { shards, results }) => {
            let what = shards::common(&shards).map_err(Exit::bad_input)?;
            finish(&what, &results, None, None, &shards).await
        }
    }
}

/// Runs the jobs of one part or takes them from `shards`; writes the results of all.
async fn finish(
    what: &What,
    results: &Results,
    shard: Option<Shard>,
    workers: Option<u16>,
    shards: &[PathBuf],
) -> Result<u8, Exit> {
    let plan = Plan::read(&what.planners, &what.patterns(), what.perception).map_err(Exit::bad_input)?;
    let out = &results.out;
    let traces = out.join("traces");
    files::writable_folder(&traces).context("--out").map_err(Exit::bad_input)?;
    let jobs = plan.jobs(what.first_seed, what.repeats, Some(&traces));
    if !shards.is_empty() {
        shards::collect(shards, out, &jobs, results.any_build).map_err(Exit::bad_input)?;
    }
    let mut execution = Execution::open(out, workers, results.any_build)?;
    let judge = if results.check.is_empty() {
        None
    } else {
        // Claims are read before the first run, not after an hour.
        let python = Python::find().map_err(|why| Exit::failed(anyhow!("--check: {why}")))?;
        write_manifest(out, &Manifest::new(&plan, what, &results.check, &[], &[], 1))?;
        python.check_claims(out).context("--check").map_err(Exit::bad_input)?;
        Some(python)
    };
    if let Some(shard) = shard {
        shards::note(out, what, shard).context("--out").map_err(Exit::bad_input)?;
        let jobs = shards::part(jobs, shard);
        let missing = execution.finish(&jobs).await?;
        show_missing(&missing);
        let Shard { index, count } = shard;
        let ran = jobs.len() - missing.len();
        print(format_args!("Shard {index}/{count}: {ran} of {} runs are in {}", jobs.len(), out.display()))?;
        return Ok(if missing.is_empty() { SUCCESS } else { FAILED });
    }
    let missing = execution.finish(&jobs).await?;
    let rows: Vec<&Row> = jobs.iter().filter_map(|job| execution.row(job)).collect();
    for old in ["report.html", "summary.json"] {
        // Those of earlier runs: without Python none are written in their place.
        let _ = std::fs::remove_file(out.join(old));
    }
    for (name, content) in results::files(&rows) {
        files::write(&out.join(name), content).map_err(Exit::failed)?;
    }
    write_manifest(out, &Manifest::new(&plan, what, &results.check, &rows, &missing, execution.workers))?;
    show_missing(&missing);
    show(&plan, &rows)?;
    let all_hold = match judge.map_or_else(Python::find, Ok) {
        Ok(python) => python.report(out).map_err(Exit::failed)?,
        Err(why) => {
            let out = out.display();
            print(format_args!("Data: {out}. No report: {why}. Then: `python3 -m curionav.report {out}`"))?;
            true
        }
    };
    Ok(if missing.is_empty() && all_hold { SUCCESS } else { FAILED })
}

fn write_manifest(out: &Path, manifest: &Manifest<'_>) -> Result<(), Exit> {
    let text = serde_json::to_vec(manifest).map_err(Exit::failed)?;
    files::write(&out.join("bench.json"), text).map_err(Exit::failed)
}

fn show_missing(missing: &[Missing]) {
    for Missing { job, reason } in missing {
        note(format_args!("no run of {} in {} with seed {}: {reason}", job.planner, job.scenario, job.seed));
    }
}

fn show(plan: &Plan, rows: &[&Row]) -> Result<(), Exit> {
    for planner in &plan.planners {
        let own = rows.iter().copied().filter(|row| row.planner == planner.name);
        let Tally { runs, success, timeouts, lost, no_way, collided } = Tally::of(own);
        print(format_args!(
            "{:<14} {success} of {runs} at the goal without collision; {collided} with collisions, \
             {timeouts} timeouts, {lost} lost, {no_way} without a way",
            planner.name
        ))?;
    }
    Ok(())
}
