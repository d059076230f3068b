//! Running what a journal lacks, and what to say when that ends early.

use std::path::Path;

use curionav_runtime::exit::Exit;
use curionav_runtime::shutdown::Shutdown;

use super::journal::Journal;
use super::plan::Job;
use super::pool::{Done, Interrupted, Pool};
use super::progress::Progress;

/// A run that could not take place.
pub(crate) struct Missing {
    pub(crate) job: Job,
    pub(crate) reason: String,
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

/// Processes to work with: as wanted, or one per core.
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
