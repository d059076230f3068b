//! Runs spread over machines: what each did, and all of it together again.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail, ensure};
use curionav_deployment::files;
use serde::{Deserialize, Serialize};

use super::journal::Journal;
use super::options::{Shard, What};
use super::plan::Job;

/// Which part of which runs a directory has.
const NOTE: &str = "shard.json";

#[derive(Debug, Serialize, Deserialize)]
struct Note {
    what: What,
    shard: Shard,
}

/// Leaves a note in `out` by which `merge` knows its part.
pub(super) fn note(out: &Path, what: &What, shard: Shard) -> anyhow::Result<()> {
    let note = Note { what: what.clone(), shard };
    files::write(&out.join(NOTE), serde_json::to_vec_pretty(&note)?)
}

/// The jobs of a part, dealt one by one: the seeds of a planner in a scenario, which take about the same time, are
/// spread over all parts. Each round begins with the next part, so that no part has always the same planner.
pub(super) fn part(jobs: Vec<Job>, shard: Shard) -> Vec<Job> {
    let is_mine = |i: &usize| (i % shard.count + i / shard.count) % shard.count == shard.index - 1;
    jobs.into_iter().enumerate().filter(|(i, _)| is_mine(i)).map(|(_, job)| job).collect()
}

/// What the shards ran, if all of them are there and belong together.
pub(super) fn common(shards: &[PathBuf]) -> anyhow::Result<What> {
    let read = |folder: &PathBuf| -> anyhow::Result<Note> {
        let path = folder.join(NOTE);
        let why = || format!("{} is no shard: `bench --shard K/N --out DIR` makes one", folder.display());
        serde_json::from_slice(&files::bytes(&path).with_context(why)?).with_context(why)
    };
    let notes: Vec<Note> = shards.iter().map(read).collect::<Result<_, _>>()?;
    let first = notes.first().context("give the directories of the shards")?;
    for (note, folder) in notes.iter().zip(shards) {
        ensure!(
            note.what == first.what && note.shard.count == first.shard.count,
            "{} and {} are shards of different runs",
            shards[0].display(),
            folder.display()
        );
    }
    for index in 1..=first.shard.count {
        let found = notes.iter().filter(|note| note.shard.index == index).count();
        ensure!(found == 1, "shard {index}/{} is there {found} times", first.shard.count);
    }
    Ok(first.what.clone())
}

/// Copies what the shards ran into the journal and the traces of `out`.
pub(super) fn collect(shards: &[PathBuf], out: &Path, jobs: &[Job], any_build: bool) -> anyhow::Result<()> {
    let program = super::plan::program_digest()?;
    let mut journal = Journal::open(&out.join("journal.jsonl"), &program, any_build)?;
    for folder in shards {
        let shard = Journal::open(&folder.join("journal.jsonl"), &program, any_build)?;
        for job in jobs {
            if let Some(row) = shard.row(&job.key) {
                journal.add(&serde_json::to_string(row)?, row.clone())?;
                if let Some((trace, name)) = job.trace.as_ref().and_then(|t| Some((t, t.file_name()?))) {
                    files::write(trace, files::bytes(&folder.join("traces").join(name))?)?;
                }
            }
        }
    }
    let missing = jobs.iter().filter(|job| journal.row(&job.key).is_none()).count();
    if missing > 0 {
        bail!(
            "{missing} of {} runs are in no shard; run the shards again, which go on where they were, with the same \
             program as `merge` or with --any-build",
            jobs.len()
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn job(i: usize) -> Job {
        Job {
            key: i.to_string(),
            scenario_file: "s".into(),
            planner_source: "p".into(),
            scenario: "s".into(),
            planner: "p".into(),
            seed: i as u64,
            perception: None,
            trace: None,
        }
    }

    /// The seeds of the jobs in each part.
    fn parts(jobs: usize, count: usize) -> Vec<Vec<u64>> {
        let of = |index| part((0..jobs).map(job).collect(), Shard { index, count });
        (1..=count).map(|index| of(index).iter().map(|job| job.seed).collect()).collect()
    }

    #[test]
    fn parts_are_disjoint_whole_and_equal() {
        for (jobs, count) in [(60, 4), (21, 5), (5, 8), (100, 7), (1, 1)] {
            let parts = parts(jobs, count);
            let mut all = parts.concat();
            all.sort_unstable();
            assert_eq!(all, (0..jobs as u64).collect::<Vec<_>>());
            let sizes = || parts.iter().map(Vec::len);
            assert!(sizes().max().unwrap() - sizes().min().unwrap() <= 1, "{parts:?}");
        }
    }

    #[test]
    fn one_scenario_is_shared_and_no_part_has_always_the_same_planner() {
        // One scenario and planner with 100 seeds.
        assert!(parts(100, 4).iter().all(|part| part.len() == 25));
        // Three planners in seven scenarios, one seed each: job 3 s + p.
        for part in parts(21, 3) {
            assert!((0..3).all(|planner| part.iter().any(|job| job % 3 == planner)), "{part:?}");
        }
    }

    #[test]
    fn a_shard_is_written_as_k_of_n() {
        assert_eq!("3/8".parse(), Ok(Shard { index: 3, count: 8 }));
        for bad in ["0/8", "9/8", "3", "3/", "a/b", "-1/2"] {
            assert!(bad.parse::<Shard>().is_err(), "{bad}");
        }
    }
}
