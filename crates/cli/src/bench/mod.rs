//! `curionav bench`: all planners in all scenarios with all seeds, and what came out.
//!
//! Read in this order: [`plan`] (what has to be run), [`pool`] and [`worker`] (how), [`journal`] (what is kept),
//! `comparison` (what it means), `acceptance` (whether that is what was hoped for), `report`.

mod acceptance;
mod comparison;
pub(crate) mod journal;
pub(crate) mod metric;
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

use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;
use std::time::Duration;

use anyhow::Context;
use curionav_runtime::shutdown::{Shutdown, on_signals};

use curionav_schemas::{Message, RunResult};

use crate::arguments::BenchOptions;
use crate::exit::{Exit, FAILED, SUCCESS};
use acceptance::Criterion;
use comparison::Comparison;
use journal::Journal;
use plan::{Job, Plan, Scene};
use pool::{Done, Interrupted, Pool};
use progress::Progress;
use row::Row;
use tally::Tally;

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
    let missing = finish(&pool, &mut journal, &jobs, &mut shutdown)
        .await
        .map_err(|error| stopped(error, &journal, &jobs, &options.out))?;
    let rows: Vec<&Row> = jobs.iter().filter_map(|job| journal.row(&job.key)).collect();
    let bench = Bench::new(&plan, &options, &jobs, &rows, &missing, pool.jobs);
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

/// A finished bench, to be told about.
pub(crate) struct Bench<'a> {
    pub(crate) comparison: Comparison<'a>,
    pub(crate) criteria: Vec<Criterion>,
    pub(crate) scenes: &'a [Scene],
    /// Files of the kept traces, by scenario and planner.
    traces: BTreeMap<(&'a str, &'a str), &'a Path>,
    pub(crate) missing: &'a [Missing],
    /// Digests of the programs that made the rows.
    pub(crate) programs: Vec<String>,
    pub(crate) first_seed: u64,
    pub(crate) repeats: u32,
    pub(crate) workers: usize,
    /// What the runs took on the clock with all workers busy.
    pub(crate) clock: Duration,
}

impl<'a> Bench<'a> {
    fn new(
        plan: &'a Plan,
        options: &BenchOptions,
        jobs: &'a [Job],
        rows: &[&'a Row],
        missing: &'a [Missing],
        workers: usize,
    ) -> Self {
        let planners = plan.planners.iter().map(|p| p.name.clone()).collect();
        let scenarios = plan.scenes.iter().map(|s| s.name.clone()).collect();
        let comparison = Comparison::new(planners, scenarios, rows);
        let worked: f64 = rows.iter().map(|row| row.wall_s).sum();
        let clock = Duration::from_secs_f64(worked / workers as f64);
        let programs: BTreeSet<String> = rows.iter().map(|row| row.program.clone()).collect();
        Self {
            criteria: acceptance::criteria(&comparison, clock),
            comparison,
            scenes: &plan.scenes,
            traces: plan::traced(jobs),
            missing,
            programs: programs.into_iter().collect(),
            first_seed: options.first_seed,
            repeats: options.repeats,
            workers,
            clock,
        }
    }

    pub(crate) fn runs(&self) -> usize {
        (0..self.comparison.planners.len()).map(|p| self.comparison.all_runs(p).count()).sum()
    }

    /// Mean over a planner's runs.
    pub(crate) fn real_time_factor(&self, planner: usize) -> Option<f64> {
        let factors: Vec<f64> = self.comparison.all_runs(planner).map(|row| row.real_time_factor).collect();
        statistics::mean(&factors)
    }

    /// The kept trace of a planner's run with the first seed; none if that run did not take place.
    pub(crate) fn trace(&self, scenario: &str, planner: &str) -> Option<RunResult> {
        let bytes = std::fs::read(self.traces.get(&(scenario, planner))?).ok()?;
        RunResult::decode(&bytes, None).ok()
    }
}

fn show(bench: &Bench<'_>, folder: &Path) {
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

/// Why the work ended before it was done.
pub(crate) fn stopped(error: anyhow::Error, journal: &Journal, jobs: &[Job], out: &Path) -> Exit {
    if !error.is::<Interrupted>() {
        return Exit::failed(error);
    }
    let kept = jobs.iter().filter(|job| journal.row(&job.key).is_some()).count();
    let kept = format!("{kept} of {} runs are kept in {}", jobs.len(), out.display());
    Exit::failed(anyhow::anyhow!("interrupted; {kept}: the same command goes on"))
}

/// `1 run`, `2 runs`.
pub(crate) fn count(number: usize, what: &str) -> String {
    if number == 1 { format!("1 {what}") } else { format!("{number} {what}s") }
}

/// Processes to work with: as wanted, or one a core.
pub(crate) fn workers(wanted: Option<u16>) -> usize {
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
