//! All planners in all scenarios with all seeds, and what came out.
//!
//! Read in this order: `plan` (what has to be run), `execution`, `worker_process` and [`worker`] (how), `journal`
//! (what is kept), `comparison` and `places` (what it means), `claims` (whether that is what was said before), `report`.

mod claims;
mod comparison;
mod density;
pub(crate) mod execution;
mod findings;
mod journal;
pub(crate) mod measure;
mod options;
mod places;
pub(crate) mod plan;
mod progress;
mod published;
mod report;
mod results;
pub(crate) mod row;
mod shards;
mod summary;
mod worker;
mod worker_process;

use std::path::PathBuf;

use anyhow::Context;
use curionav_deployment::files;
use curionav_runtime::exit::{Exit, FAILED, SUCCESS};
use curionav_runtime::print::print;

use claims::{Claims, Judged};
use execution::Execution;
use findings::Findings;
use options::{Command, Results, Shard, What};
use plan::Plan;
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
    let planners: Vec<String> = plan.planners.iter().map(|planner| planner.name.clone()).collect();
    let read = |file: &PathBuf| Claims::read(file, &planners, plan.scenes.len());
    let claims: anyhow::Result<Vec<Claims>> = results.check.iter().map(read).collect();
    let claims = claims.context("--check").map_err(Exit::bad_input)?;
    let out = &results.out;
    let traces = out.join("traces");
    files::make_folder(&traces).context("--out").map_err(Exit::bad_input)?;
    let jobs = plan.jobs(what.first_seed, what.repeats, Some(&traces));
    if !shards.is_empty() {
        shards::collect(shards, out, &jobs, results.any_build).map_err(Exit::bad_input)?;
    }
    let mut execution = Execution::open(out, workers, results.any_build)?;
    if let Some(shard) = shard {
        shards::note(out, what, shard).context("--out").map_err(Exit::bad_input)?;
        let jobs = shards::part(jobs, what.repeats, shard);
        let missing = execution.finish(&jobs).await?;
        show_missing(&missing);
        let Shard { index, count } = shard;
        let ran = jobs.len() - missing.len();
        print(format_args!("Shard {index}/{count}: {ran} of {} runs are in {}", jobs.len(), out.display()))?;
        return Ok(if missing.is_empty() { SUCCESS } else { FAILED });
    }
    let missing = execution.finish(&jobs).await?;
    let rows: Vec<&Row> = jobs.iter().filter_map(|job| execution.row(job)).collect();
    let bench = Findings::new(&plan, what, &claims, &jobs, &rows, &missing, execution.workers);
    for (name, content) in results::files(&bench, &rows).map_err(Exit::failed)? {
        files::write(&out.join(name), content).map_err(Exit::failed)?;
    }
    show(&bench)?;
    print(format_args!("Report and data: {}", out.join("report.html").display()))?;
    let all_hold = bench.claims.iter().all(|judged| judged.holds);
    Ok(if missing.is_empty() && all_hold { SUCCESS } else { FAILED })
}

fn show_missing(missing: &[Missing]) {
    for Missing { job, reason } in missing {
        eprintln!("no run of {} in {} with seed {}: {reason}", job.planner, job.scenario, job.seed);
    }
}

fn show(bench: &Findings<'_>) -> Result<(), Exit> {
    show_missing(bench.missing);
    for (p, name) in bench.comparison.planners.iter().enumerate() {
        let Tally { runs, success, timeouts, lost, collided, .. } = Tally::of(bench.comparison.all_runs(p));
        print(format_args!(
            "{name:<14} {success} of {runs} at the goal without collision; {collided} with collisions, \
             {timeouts} timeouts, {lost} lost"
        ))?;
    }
    for judged in &bench.claims {
        let Judged { claim, found, .. } = judged;
        print(format_args!("{}: {claim} ({found})", judged.verdict()))?;
    }
    Ok(())
}
