//! Jobs spread over worker processes, and the journal that keeps what came of them.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow};
use curionav_runtime::exit::Exit;
use curionav_runtime::shutdown::{Shutdown, on_signals};
use tokio::task::JoinSet;

use super::journal::Journal;
use super::plan::{self, Job};
use super::progress::Progress;
use super::row::Row;
use super::worker_process::{Done, Missing, WorkerProcess, attempt};

/// Runs jobs, each once, also across interruptions.
pub(crate) struct Execution {
    pub(crate) workers: usize,
    program: String,
    journal: Journal,
    shutdown: Shutdown,
    out: PathBuf,
}

impl Execution {
    /// Opens the journal in the directory `out`. `workers` is one per core if absent; `any_build` also takes rows of
    /// other builds.
    pub(crate) fn open(out: &Path, workers: Option<u16>, any_build: bool) -> Result<Self, Exit> {
        let program = plan::program_digest().map_err(Exit::failed)?;
        let journal =
            Journal::open(&out.join("journal.jsonl"), &program, any_build).map_err(Exit::bad_input)?;
        let cores = || std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
        Ok(Self {
            workers: workers.map_or_else(cores, usize::from),
            program,
            journal,
            shutdown: on_signals().map_err(Exit::network)?,
            out: out.to_owned(),
        })
    }

    /// What came of a job; nothing if it has not been run.
    pub(crate) fn row(&self, job: &Job) -> Option<&Row> {
        self.journal.row(&job.key)
    }

    /// Runs what the journal does not have yet; gives what could not run, in the order of the jobs.
    pub(crate) async fn finish(&mut self, jobs: &[Job]) -> Result<Vec<Missing>, Exit> {
        let is_kept = |job: &&Job| self.row(job).is_some() && job.trace.as_deref().is_none_or(Path::is_file);
        let open: Vec<Job> = jobs.iter().filter(|job| !is_kept(job)).cloned().collect();
        let mut progress = Progress::new(open.len());
        let mut shutdown = self.shutdown.clone();
        let ran = tokio::select! {
            ran = self.run(open, &mut progress) => ran,
            // Every worker is killed.
            () = shutdown.requested() => Err(self.interrupted(jobs)),
        };
        progress.finish();
        let mut missing = ran.map_err(Exit::failed)?;
        missing.sort_by_key(|m| jobs.iter().position(|job| job.key == m.job.key));
        Ok(missing)
    }

    fn interrupted(&self, jobs: &[Job]) -> anyhow::Error {
        let kept = jobs.iter().filter(|job| self.row(job).is_some()).count();
        let kept = format!("{kept} of {} runs are kept in {}", jobs.len(), self.out.display());
        anyhow!("interrupted; {kept}: the same command goes on")
    }

    async fn run(&mut self, jobs: Vec<Job>, progress: &mut Progress) -> anyhow::Result<Vec<Missing>> {
        let mut queue = jobs.into_iter();
        let mut missing = Vec::new();
        // Dropped on the way out, it aborts its tasks, and each takes its process along.
        let mut running: JoinSet<(Option<WorkerProcess>, Done)> = JoinSet::new();
        for job in queue.by_ref().take(self.workers) {
            running.spawn(attempt(self.program.clone(), None, job));
        }
        while let Some(ended) = running.join_next().await {
            let (worker, done) = ended.context("a task of the bench")?;
            match done {
                Ok((row, line)) => {
                    progress.step(&format!("last {}, {}, seed {}", row.scenario, row.planner, row.seed));
                    self.journal.add(&line, row)?;
                }
                Err(one) => {
                    progress.step("one failed");
                    missing.push(one);
                }
            }
            if let Some(job) = queue.next() {
                running.spawn(attempt(self.program.clone(), worker, job));
            }
        }
        Ok(missing)
    }
}
