//! A service or a router as a process of this program, which ends at the latest with this one.

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use curionav_runtime::heartbeat::ALIVE;
use curionav_runtime::process::{ProcessLine, Ready};
use tokio::io::{AsyncBufReadExt, AsyncWriteExt, BufReader};
use tokio::process::{Child, Command};
use tokio::sync::{Notify, watch};

use crate::pulse::{Pulse, Verdict};

const READY_TIMEOUT: Duration = Duration::from_secs(20);
const STOP_TIMEOUT: Duration = Duration::from_secs(5);
/// For all at once at the end of this program, twice: services first, then their router.
const END_TIMEOUT: Duration = Duration::from_millis(700);
/// Between two looks whether a process still runs, and works.
const LOOK: Duration = Duration::from_millis(100);
/// Clock ticks of `/proc/PID/stat` in a second, on every Linux.
const TICKS: f64 = 100.0;

/// A process that ends when its standard input closes, so at the latest with this one.
pub struct Supervised {
    name: String,
    arguments: Vec<String>,
    metrics: Option<SocketAddr>,
    child: Child,
    /// How often it has said that it works.
    alive: watch::Receiver<u64>,
    pulse: Pulse,
    restarts: VecDeque<Instant>,
    /// Whether it waits because it has ended too often.
    rests: bool,
}

impl Supervised {
    /// Starts this program with `arguments` and waits until it says that it is ready.
    pub async fn start(program: &Path, name: &str, arguments: Vec<String>) -> anyhow::Result<(Self, Ready)> {
        let mut child = Command::new(program)
            .args(&arguments)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .stderr(Stdio::inherit())
            .kill_on_drop(true)
            .spawn()
            .with_context(|| format!("cannot start {name}"))?;
        let stdout = child.stdout.take().context("no standard output")?;
        let mut lines = BufReader::new(stdout).lines();
        let line = tokio::time::timeout(READY_TIMEOUT, lines.next_line())
            .await
            .map_err(|_| anyhow::anyhow!("{name} was not ready within {} s", READY_TIMEOUT.as_secs()))??;
        let Some(line) = line else {
            let status = child.wait().await?;
            bail!("{name} ended before it was ready ({status}); its reason is above");
        };
        let ready: Ready = serde_json::from_str(&line).with_context(|| format!("{name} printed `{line}`"))?;
        let (says, alive) = watch::channel(0);
        tokio::spawn(async move {
            while let Ok(Some(line)) = lines.next_line().await {
                if line == ALIVE {
                    says.send_modify(|count| *count += 1);
                }
            }
        });
        let name = name.into();
        let metrics = ready.metrics;
        let pulse = Pulse::default();
        let restarts = VecDeque::new();
        let mut process = Self { name, arguments, metrics, child, alive, pulse, restarts, rests: false };
        // Started again, it must be where its metrics are looked for.
        if let Some(address) = ready.metrics {
            process.replace("--metrics", &address.to_string());
        }
        Ok((process, ready))
    }

    /// Replaces the value of an argument.
    fn replace(&mut self, argument: &str, value: &str) {
        let mut rest = self.arguments.iter_mut().skip_while(|a| a.as_str() != argument).skip(1);
        if let Some(old) = rest.next() {
            value.clone_into(old);
        }
    }

    /// What `curionav up` says of it.
    pub fn line(&self) -> ProcessLine {
        ProcessLine { name: self.name.clone(), pid: self.pid(), metrics: self.metrics }
    }

    /// Starts a router that listens on `port` of 127.0.0.1 (0: a free one) and links with `others`; also says where.
    /// With a folder of certificates it listens over TLS.
    pub async fn router(
        program: &Path,
        port: u16,
        others: &[String],
        secure: Option<&Path>,
        log: &str,
    ) -> anyhow::Result<(Self, String)> {
        let protocol = if secure.is_some() { "tls" } else { "tcp" };
        let listen = format!("{protocol}/127.0.0.1:{port}");
        let arguments = ["router", "--listen", &listen, "--supervised", "--log", log].map(String::from);
        let links = others.iter().flat_map(|other| ["--connect".to_owned(), other.clone()]);
        let arguments = arguments.into_iter().chain(links).chain(secure_arguments(secure)).collect();
        let (mut router, ready) = Self::start(program, "router", arguments).await?;
        let endpoint = ready.endpoints.first().context("the router did not say where it listens")?.clone();
        // Started again, it must be where the others look for it.
        router.replace("--listen", &endpoint);
        Ok((router, endpoint))
    }

    /// Its number, 0 once it has ended.
    pub fn pid(&self) -> u32 {
        self.child.id().unwrap_or(0)
    }

    /// Starts it again whenever it has ended by itself, or was ended because it hung, and ends and starts it when
    /// `restart` says so. One that ends again and again is started `limit` times within a minute: nothing else ends
    /// for it. It does not complete.
    ///
    /// # Errors
    /// If it cannot be asked whether it still runs.
    pub async fn keep_alive(&mut self, program: &Path, limit: usize, restart: &Notify) -> anyhow::Result<()> {
        loop {
            tokio::select! {
                () = tokio::time::sleep(LOOK) => {}
                () = restart.notified() => self.restart(program).await,
            }
            self.end_if_it_hangs().await;
            self.revive(program, limit).await?;
        }
    }

    async fn end_if_it_hangs(&mut self) {
        let has_answered = self.alive.has_changed().unwrap_or(false);
        self.alive.mark_unchanged();
        match self.pulse.look(has_answered, processor_time(&self.pid().to_string())) {
            Verdict::Wait => {}
            Verdict::Ask => {
                // One byte at a time always has room. A process that has ended is noticed by that.
                if let Some(input) = &mut self.child.stdin {
                    let _ = input.write_all(b"\n").await;
                }
            }
            Verdict::Hangs => {
                tracing::warn!(process = %self.name, "has not answered for long, killed");
                let _ = self.child.kill().await;
            }
        }
    }

    /// Ends it as it is meant to end, and starts it again; that it does not start is noticed as its end.
    async fn restart(&mut self, program: &Path) {
        tracing::info!(process = %self.name, "started anew");
        drop(self.child.stdin.take());
        if tokio::time::timeout(STOP_TIMEOUT, self.child.wait()).await.is_err() {
            let _ = self.child.kill().await;
        }
        self.start_again(program).await;
    }

    async fn revive(&mut self, program: &Path, limit: usize) -> anyhow::Result<()> {
        let Some(status) = self.child.try_wait()? else { return Ok(()) };
        let now = Instant::now();
        while self.restarts.front().is_some_and(|t| now.duration_since(*t) > Duration::from_secs(60)) {
            self.restarts.pop_front();
        }
        if self.restarts.len() >= limit {
            if !std::mem::replace(&mut self.rests, true) {
                tracing::error!(
                    process = %self.name, %status, "ended {} times within a minute, rests until that is over", limit + 1
                );
            }
            return Ok(());
        }
        self.rests = false;
        tracing::warn!(process = %self.name, %status, "ended, started again");
        self.restarts.push_back(now);
        self.start_again(program).await;
        Ok(())
    }

    /// Kills it, and starts it again where it was.
    pub async fn kill_and_start(&mut self, program: &Path) {
        let _ = self.child.kill().await;
        self.start_again(program).await;
    }

    /// One that fails to start has ended again: the next look counts it.
    async fn start_again(&mut self, program: &Path) {
        match Supervised::start(program, &self.name, self.arguments.clone()).await {
            Ok((mut fresh, _)) => {
                fresh.restarts = std::mem::take(&mut self.restarts);
                *self = fresh;
            }
            Err(error) => tracing::warn!(process = %self.name, error = format!("{error:#}"), "did not start"),
        }
    }

    /// Ends them: asks all of them first, by closing their standard input, and then waits, but not for long: this
    /// program has a second and a half to end, and what hangs must not outlive it.
    pub async fn stop_all(mut processes: Vec<Self>) {
        processes.iter_mut().for_each(|process| drop(process.child.stdin.take()));
        let deadline = tokio::time::Instant::now() + END_TIMEOUT;
        for Self { name, mut child, .. } in processes {
            if tokio::time::timeout_at(deadline, child.wait()).await.is_err() {
                tracing::warn!(process = %name, "did not end in time, killed");
                let _ = child.kill().await;
            }
        }
    }
}

/// What makes this program run one supervised service behind the router at `endpoint`.
pub fn client_arguments(
    kind: &str,
    endpoint: &str,
    instance: &str,
    secure: Option<&Path>,
    log: &str,
) -> Vec<String> {
    let arguments = [kind, "--connect", endpoint, "--instance", instance, "--supervised", "--log", log];
    arguments.map(String::from).into_iter().chain(secure_arguments(secure)).collect()
}

fn secure_arguments(folder: Option<&Path>) -> impl Iterator<Item = String> {
    folder.into_iter().flat_map(|folder| ["--secure".to_owned(), folder.display().to_string()])
}

/// Processor time that a process has taken since its start; nothing where there is no `/proc`. `self` is this process.
pub fn processor_time(pid: &str) -> Duration {
    let stat = std::fs::read_to_string(format!("/proc/{pid}/stat")).unwrap_or_default();
    // After the name, which may contain anything: utime and stime are fields 14 and 15, the name is field 2.
    let fields = stat.rsplit(')').next().unwrap_or_default().split_whitespace().skip(11).take(2);
    let ticks: u64 = fields.filter_map(|field| field.parse::<u64>().ok()).sum();
    Duration::from_secs_f64(ticks as f64 / TICKS)
}
