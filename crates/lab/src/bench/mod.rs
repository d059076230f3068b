//! All planners in all scenarios with all seeds, and what came out.
//!
//! Read in this order: [`plan`] (what has to be run), [`pool`] and [`worker`] (how), [`journal`] (what is kept),
//! `comparison` (what it means), `acceptance` (whether that is what was hoped for), `report`.

mod acceptance;
mod comparison;
pub(crate) mod execution;
mod findings;
pub(crate) mod journal;
pub(crate) mod measure;
mod options;
pub(crate) mod plan;
pub(crate) mod pool;
mod progress;
mod published;
mod report;
mod results;
pub(crate) mod row;
pub(crate) mod statistics;
mod summary;
mod tally;
mod worker;

use std::path::Path;

use anyhow::Context;
use curionav_runtime::exit::{Exit, FAILED, SUCCESS};
use curionav_runtime::shutdown::on_signals;

use execution::{Missing, finish, stopped, workers};
use findings::Findings;
use journal::Journal;
use plan::Plan;
use pool::Pool;
use row::Row;
use tally::Tally;

pub use options::Options;
pub use worker::worker;

/// Runs what is not in the journal yet, writes all results, and gives the exit status.
///
/// # Errors
/// Bad input if planners, scenarios or the directory cannot be used; failed if interrupted.
pub async fn bench(options: Options) -> Result<u8, Exit> {
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
    let missing = finish(&pool, &mut journal, &jobs, &mut shutdown)
        .await
        .map_err(|error| stopped(error, &journal, &jobs, &options.out))?;
    let rows: Vec<&Row> = jobs.iter().filter_map(|job| journal.row(&job.key)).collect();
    let bench = Findings::new(&plan, &options, &jobs, &rows, &missing, pool.jobs);
    let summary =
        serde_json::to_string_pretty(&summary::summary(&bench)).map_err(|e| Exit::failed(e.into()))?;
    let files = [
        ("results.csv", results::results(&rows)),
        ("timings.csv", results::timings(&rows)),
        ("summary.json", summary + "\n"),
        ("report.html", report::report(&bench)),
    ];
    write(&options.out, &files).map_err(Exit::failed)?;
    show(&bench, &options.out);
    Ok(if missing.is_empty() { SUCCESS } else { FAILED })
}

fn show(bench: &Findings<'_>, folder: &Path) {
    for Missing { job, reason } in bench.missing {
        eprintln!("no run of {} in {} with seed {}: {reason}", job.planner, job.scenario, job.seed);
    }
    #[expect(clippy::print_stdout, reason = "what the command is for")]
    {
        for (p, name) in bench.comparison.planners.iter().enumerate() {
            let Tally { runs, success, timeouts, lost, collided, .. } =
                Tally::of(bench.comparison.all_runs(p));
            println!(
                "{name:<14} {success} of {runs} at the goal without collision; {collided} with collisions, \
                 {timeouts} timeouts, {lost} lost"
            );
        }
        println!("Report and data: {}", folder.join("report.html").display());
    }
}

fn write(folder: &Path, files: &[(&str, String)]) -> anyhow::Result<()> {
    for (name, content) in files {
        let path = folder.join(name);
        std::fs::write(&path, content).with_context(|| format!("cannot write {}", path.display()))?;
    }
    Ok(())
}
