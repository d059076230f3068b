//! A service or a router as a process of this program, which ends at the latest with this one.

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use curionav_runtime::process::{ProcessLine, Ready};
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::{Child, Command};

const READY_TIMEOUT: Duration = Duration::from_secs(20);
const STOP_TIMEOUT: Duration = Duration::from_secs(5);
/// Between two looks whether a process still runs.
const LOOK: Duration = Duration::from_millis(100);

/// A process that ends when its standard input closes, so at the latest with this one.
pub struct Supervised {
    name: String,
    arguments: Vec<String>,
    metrics: Option<SocketAddr>,
    child: Child,
    restarts: VecDeque<Instant>,
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
        let mut process =
            Self { name: name.into(), arguments, metrics: ready.metrics, child, restarts: VecDeque::new() };
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

    /// Starts a router that listens on `port` of 127.0.0.1 (0: a free one); also says where. With a folder of
    /// certificates it listens over TLS.
    pub async fn router(
        program: &Path,
        port: u16,
        secure: Option<&Path>,
        log: &str,
    ) -> anyhow::Result<(Self, String)> {
        let protocol = if secure.is_some() { "tls" } else { "tcp" };
        let listen = format!("{protocol}/127.0.0.1:{port}");
        let arguments = ["router", "--listen", &listen, "--supervised", "--log", log].map(String::from);
        let arguments = arguments.into_iter().chain(secure_arguments(secure)).collect();
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

    /// Starts it again whenever it has ended by itself.
    ///
    /// # Errors
    /// Once it has ended more than `limit` times within a minute. It does not complete otherwise.
    pub async fn keep_alive(&mut self, program: &Path, limit: usize) -> anyhow::Result<()> {
        loop {
            tokio::time::sleep(LOOK).await;
            self.revive(program, limit).await?;
        }
    }

    async fn revive(&mut self, program: &Path, limit: usize) -> anyhow::Result<()> {
        let Some(status) = self.child.try_wait()? else { return Ok(()) };
        let now = Instant::now();
        while self.restarts.front().is_some_and(|t| now.duration_since(*t) > Duration::from_secs(60)) {
            self.restarts.pop_front();
        }
        if self.restarts.len() >= limit {
            bail!("{} ended {} times within a minute (last: {status}); giving up", self.name, limit + 1);
        }
        tracing::warn!(process = %self.name, %status, "ended, started again");
        self.restarts.push_back(now);
        // One that fails to start has ended again: the next round counts it.
        match Supervised::start(program, &self.name, self.arguments.clone()).await {
            Ok((mut fresh, _)) => {
                fresh.restarts = std::mem::take(&mut self.restarts);
                *self = fresh;
            }
            Err(error) => tracing::warn!(process = %self.name, error = format!("{error:#}"), "did not start"),
        }
        Ok(())
    }

    /// Ends them: asks all of them first, by closing their standard input, and then waits.
    pub async fn stop_all(mut processes: Vec<Self>) {
        processes.iter_mut().for_each(|process| drop(process.child.stdin.take()));
        let deadline = tokio::time::Instant::now() + STOP_TIMEOUT;
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
