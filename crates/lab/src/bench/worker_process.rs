//! A worker process from the side that hands it jobs.

use std::process::Stdio;
use std::time::Duration;

use anyhow::{Context, bail};
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, Lines};
use tokio::process::{Child, ChildStdin, ChildStdout, Command};

use super::plan::Job;
use super::row::Row;
use super::worker::Refusal;

/// Attempts at a run, each in a fresh process but the first.
const ATTEMPTS: u32 = 2;
/// Longest a run may take on the clock: far beyond any on a busy machine, so that one that hangs does not
/// hold up the bench for ever.
const RUN_LIMIT: Duration = Duration::from_secs(900);

pub(crate) struct Missing {
    pub(crate) job: Job,
    pub(crate) reason: String,
}

pub(super) type Done = Result<(Row, String), Missing>;

/// Runs a job in `worker`, or in a fresh process; `program` is the program's digest. Also gives the worker back if it
/// may take another job.
pub(super) async fn attempt(
    program: String,
    mut worker: Option<WorkerProcess>,
    job: Job,
) -> (Option<WorkerProcess>, Done) {
    let mut reason = String::new();
    for _ in 0..ATTEMPTS {
        match ask(&program, &mut worker, &job).await {
            Ok(answer) => return (worker, Ok(answer)),
            Err(error) => {
                reason = format!("{error:#}");
                // Whatever state it is in, it shall not touch another run; dropping it kills it.
                worker = None;
                let Job { scenario, planner, seed, .. } = &job;
                tracing::warn!(scenario, planner, seed, reason, "no run");
            }
        }
    }
    (worker, Err(Missing { job, reason }))
}

async fn ask(program: &str, slot: &mut Option<WorkerProcess>, job: &Job) -> anyhow::Result<(Row, String)> {
    let worker = match slot {
        Some(worker) => worker,
        None => slot.insert(WorkerProcess::start(program)?),
    };
    match tokio::time::timeout(RUN_LIMIT, worker.ask(job)).await {
        Ok(answer) => answer,
        Err(_) => bail!("no end after {} s", RUN_LIMIT.as_secs()),
    }
}

/// A worker process; killed when dropped.
pub(super) struct WorkerProcess {
    child: Child,
    jobs: ChildStdin,
    answers: Lines<BufReader<ChildStdout>>,
}

impl WorkerProcess {
    fn start(program: &str) -> anyhow::Result<Self> {
        let path = std::env::current_exe().context("cannot find this program's file")?;
        let mut child = Command::new(path)
            .args(["worker", "--program", program, "--log", "error"])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            // Ctrl-C in a terminal is for the one that started it.
            .process_group(0)
            .kill_on_drop(true)
            .spawn()
            .context("cannot start a worker")?;
        let jobs = child.stdin.take().context("no standard input")?;
        let answers = BufReader::new(child.stdout.take().context("no standard output")?).lines();
        Ok(Self { child, jobs, answers })
    }

    async fn ask(&mut self, job: &Job) -> anyhow::Result<(Row, String)> {
        let question = serde_json::to_string(job)? + "\n";
        // A worker that has died is found out by the missing answer.
        let _ = self.jobs.write_all(question.as_bytes()).await;
        let _ = self.jobs.flush().await;
        let Some(line) = self.answers.next_line().await? else {
            let status = self.child.wait().await?;
            bail!("the worker process ended ({status})");
        };
        if let Ok(refusal) = serde_json::from_str::<Refusal>(&line) {
            bail!("{}", refusal.error);
        }
        let row: Row = serde_json::from_str(&line).with_context(|| format!("a worker answered `{line}`"))?;
        Ok((row, line))
    }
}
