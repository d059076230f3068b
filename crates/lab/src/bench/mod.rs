//! All planners in all scenarios with all seeds, and what came out.
//!
//! Read in this order: `plan` (what has to be run), `execution`, `worker_process` and [`worker`] (how), `journal`
//! (what is kept), `comparison` (what it means), `acceptance` (whether that is what was hoped for), `report`.

mod acceptance;
mod comparison;
pub(crate) mod execution;
mod findings;
mod journal;
pub(crate) mod measure;
mod options;
pub(crate) mod plan;
mod progress;
mod published;
mod report;
mod results;
pub(crate) mod row;
mod summary;
mod worker;
mod worker_process;

use anyhow::Context;
use curionav_deployment::files;
use curionav_runtime::exit::{Exit, FAILED, SUCCESS};
use curionav_runtime::print::print;

use execution::Execution;
use findings::Findings;
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
    let plan = Plan::read(&options.planners, &options.scenarios).map_err(Exit::bad_input)?;
    let traces = options.out.join("traces");
    files::make_folder(&traces).context("--out").map_err(Exit::bad_input)?;
    let mut execution = Execution::open(&options.out, options.jobs, options.any_build)?;
    let jobs = plan.jobs(options.first_seed, options.repeats, Some(&traces));
    let missing = execution.finish(&jobs).await?;
    let rows: Vec<&Row> = jobs.iter().filter_map(|job| execution.row(job)).collect();
    let bench = Findings::new(&plan, &options, &jobs, &rows, &missing, execution.workers);
    for (name, content) in results::files(&bench, &rows).map_err(Exit::failed)? {
        files::write(&options.out.join(name), content).map_err(Exit::failed)?;
    }
    show(&bench)?;
    print(format_args!("Report and data: {}", options.out.join("report.html").display()))?;
    Ok(if missing.is_empty() { SUCCESS } else { FAILED })
}

fn show(bench: &Findings<'_>) -> Result<(), Exit> {
    for Missing { job, reason } in bench.missing {
        eprintln!("no run of {} in {} with seed {}: {reason}", job.planner, job.scenario, job.seed);
    }
    for (p, name) in bench.comparison.planners.iter().enumerate() {
        let Tally { runs, success, timeouts, lost, collided, .. } = Tally::of(bench.comparison.all_runs(p));
        print(format_args!(
            "{name:<14} {success} of {runs} at the goal without collision; {collided} with collisions, \
             {timeouts} timeouts, {lost} lost"
        ))?;
    }
    Ok(())
}
