//! Worker processes that share a list of jobs.

use std::collections::VecDeque;
use std::path::PathBuf;
use std::process::Stdio;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Duration;

use anyhow::{Context, bail};
use curionav_runtime::shutdown::Shutdown;
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader, Lines};
use tokio::process::{Child, ChildStdin, ChildStdout, Command};
use tokio::sync::mpsc;
use tokio::task::JoinSet;

use super::plan::Job;
use super::row::Row;
use super::worker::Refusal;

/// Attempts at a run, each in a fresh process but the first.
const ATTEMPTS: u32 = 2;
/// Longest a run may take on the clock: far beyond any on a busy machine, so that one that hangs does not
/// hold up the bench for ever.
const RUN_LIMIT: Duration = Duration::from_secs(900);

/// How to start workers.
#[derive(Debug, Clone)]
pub(crate) struct Pool {
    /// Processes at a time.
    pub(crate) jobs: usize,
    /// Digest of the program, for the rows.
    pub(crate) program: String,
}

/// A job that came to an end.
pub(crate) enum Done {
    /// The row and the line it came in.
    Row(Box<Row>, String),
    /// No run took place, and why.
    Failed(Job, String),
}

/// The signal to end came before the work was done.
#[derive(Debug, thiserror::Error)]
#[error("interrupted")]
pub(crate) struct Interrupted;

impl Pool {
    /// Runs all jobs, in any order; `on_done` hears of each. When `shutdown` fires, every worker is killed.
    ///
    /// # Errors
    /// [`Interrupted`], or what `on_done` returns.
    pub(crate) async fn run(
        &self,
        jobs: Vec<Job>,
        shutdown: &mut Shutdown,
        mut on_done: impl FnMut(Done) -> anyhow::Result<()>,
    ) -> anyhow::Result<()> {
        let workers = self.jobs.min(jobs.len());
        let queue = Arc::new(Mutex::new(VecDeque::from(jobs)));
        let (sender, mut done) = mpsc::channel(self.jobs.max(1));
        // Dropped on the way out, it aborts its tasks, and each takes its process along.
        let mut tasks = JoinSet::new();
        for _ in 0..workers {
            tasks.spawn(work(self.clone(), Arc::clone(&queue), sender.clone()));
        }
        drop(sender);
        loop {
            tokio::select! {
                () = shutdown.requested() => return Err(Interrupted.into()),
                one = done.recv() => match one {
                    Some(one) => on_done(one)?,
                    None => break,
                },
            }
        }
        while let Some(ended) = tasks.join_next().await {
            ended.context("a task of the pool")?;
        }
        Ok(())
    }
}

async fn work(pool: Pool, queue: Arc<Mutex<VecDeque<Job>>>, done: mpsc::Sender<Done>) {
    let mut worker = None;
    loop {
        let next = queue.lock().unwrap_or_else(PoisonError::into_inner).pop_front();
        let Some(job) = next else { break };
        if done.send(attempt(&pool, &mut worker, job).await).await.is_err() {
            return;
        }
    }
    if let Some(worker) = worker {
        worker.end().await;
    }
}

async fn attempt(pool: &Pool, worker: &mut Option<Worker>, job: Job) -> Done {
    let mut reason = String::new();
    for _ in 0..ATTEMPTS {
        match ask(pool, worker, &job).await {
            Ok((row, line)) => return Done::Row(Box::new(row), line),
            Err(error) => {
                reason = format!("{error:#}");
                // Whatever state it is in, it shall not touch another run; dropping it kills it.
                *worker = None;
                tracing::warn!(
                    scenario = job.scenario,
                    planner = job.planner,
                    seed = job.seed,
                    reason,
                    "no run"
                );
            }
        }
    }
    Done::Failed(job, reason)
}

async fn ask(pool: &Pool, slot: &mut Option<Worker>, job: &Job) -> anyhow::Result<(Row, String)> {
    let worker = match slot {
        Some(worker) => worker,
        None => slot.insert(Worker::start(&pool.program)?),
    };
    match tokio::time::timeout(RUN_LIMIT, worker.ask(job)).await {
        Ok(answer) => answer,
        Err(_) => bail!("no end after {} s", RUN_LIMIT.as_secs()),
    }
}

/// A worker process; killed when dropped.
struct Worker {
    child: Child,
    jobs: ChildStdin,
    answers: Lines<BufReader<ChildStdout>>,
}

impl Worker {
    fn start(program: &str) -> anyhow::Result<Self> {
        let path: PathBuf = std::env::current_exe().context("cannot find this program's file")?;
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

    async fn end(mut self) {
        drop(self.jobs);
        let _ = self.child.wait().await;
    }
}
