//! `curionav up`: router and services as processes on this machine, supervised.

use std::collections::VecDeque;
use std::net::SocketAddr;
use std::path::Path;
use std::process::Stdio;
use std::time::{Duration, Instant};

use anyhow::{Context, bail};
use curionav_runtime::process::{ProcessLine, Ready};
use curionav_runtime::shutdown::Shutdown;
use serde::Deserialize;
use tokio::io::{AsyncBufReadExt, BufReader};
use tokio::process::{Child, Command};

/// What `curionav up` starts. All fields have defaults: an empty file is one of everything.
#[derive(Debug, Clone, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Deployment {
    /// Robot name, part of every robot key.
    robot: String,
    /// World name of the simulator.
    world: String,
    /// Prefix of every key.
    namespace: Option<String>,
    /// TCP port of the router on 127.0.0.1; 0 takes a free one.
    port: u16,
    /// First of consecutive TCP ports on 127.0.0.1 for the metrics of each service; 0 takes free ones.
    metrics_port: Option<u16>,
    /// How many processes of each kind.
    replicas: Replicas,
    /// Restarts of one process within a minute before the deployment is given up.
    max_restarts_per_minute: usize,
}

/// Processes per kind; the simulator may be 0 (a real robot), the others at least 1.
#[derive(Debug, Clone, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub(crate) struct Replicas {
    generator: usize,
    cpc: usize,
    hccdm: usize,
    simulator: usize,
}

impl Default for Replicas {
    fn default() -> Self {
        Self { generator: 1, cpc: 1, hccdm: 1, simulator: 1 }
    }
}

impl Default for Deployment {
    fn default() -> Self {
        Self {
            robot: "robot".into(),
            world: "world".into(),
            namespace: None,
            port: 7447,
            metrics_port: None,
            replicas: Replicas::default(),
            max_restarts_per_minute: 5,
        }
    }
}

impl Deployment {
    pub(crate) fn from_file(path: &Path) -> anyhow::Result<Self> {
        let text =
            std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let deployment: Self = toml::from_str(&text).map_err(|e| {
            anyhow::anyhow!(
                "{}: {}",
                path.display(),
                curionav_runtime::config::describe_toml_error(&text, &e)
            )
        })?;
        for (field, count) in [
            ("generator", deployment.replicas.generator),
            ("cpc", deployment.replicas.cpc),
            ("hccdm", deployment.replicas.hccdm),
        ] {
            if count == 0 || count > 64 {
                bail!("{}: replicas.{field} must be 1 to 64, found {count}", path.display());
            }
        }
        Ok(deployment)
    }

    pub(crate) fn with_port(mut self, port: Option<u16>) -> Self {
        self.port = port.unwrap_or(self.port);
        self
    }

    /// (subcommand, instance) of every service process.
    fn processes(&self) -> Vec<(&'static str, String)> {
        let mut all = Vec::new();
        let mut add = |kind: &'static str, count: usize| {
            all.extend((0..count).map(|i| (kind, format!("{kind}-{i}"))));
        };
        add("driver", 1);
        add("localizer", 1);
        add("generator", self.replicas.generator);
        add("cpc", self.replicas.cpc);
        add("hccdm", self.replicas.hccdm);
        add("arbiter", 1);
        add("simulator", self.replicas.simulator);
        all
    }
}

/// A process that ends when its standard input closes, so at the latest with this one.
pub(crate) struct Supervised {
    name: String,
    arguments: Vec<String>,
    metrics: Option<SocketAddr>,
    child: Child,
    restarts: VecDeque<Instant>,
}

const READY_TIMEOUT: Duration = Duration::from_secs(20);
const STOP_TIMEOUT: Duration = Duration::from_secs(5);

impl Supervised {
    /// Starts this program with `arguments` and waits until it says that it is ready.
    pub(crate) async fn start(
        program: &Path,
        name: &str,
        arguments: Vec<String>,
    ) -> anyhow::Result<(Self, Ready)> {
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
        // Started again, it must be where whoever scrapes it looks for it.
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

    fn line(&self) -> ProcessLine {
        ProcessLine { name: self.name.clone(), pid: self.pid(), metrics: self.metrics }
    }

    /// Starts a router that listens on `port` of 127.0.0.1 (0: a free one); also says where.
    pub(crate) async fn router(program: &Path, port: u16, log: &str) -> anyhow::Result<(Self, String)> {
        let listen = format!("tcp/127.0.0.1:{port}");
        let arguments = ["router", "--listen", &listen, "--supervised", "--log", log].map(String::from);
        let (mut router, ready) = Self::start(program, "router", arguments.to_vec()).await?;
        let endpoint = ready.endpoints.first().context("the router did not say where it listens")?.clone();
        // Started again, it must be where everybody looks for it.
        router.replace("--listen", &endpoint);
        Ok((router, endpoint))
    }

    /// Its number, 0 once it has ended.
    pub(crate) fn pid(&self) -> u32 {
        self.child.id().unwrap_or(0)
    }

    /// Ends it, asking first.
    pub(crate) async fn stop(mut self) {
        // Closing its standard input asks it to end; after that it is killed.
        drop(self.child.stdin.take());
        if tokio::time::timeout(STOP_TIMEOUT, self.child.wait()).await.is_err() {
            tracing::warn!(process = %self.name, "did not end in time, killed");
            let _ = self.child.kill().await;
        }
    }
}

/// What makes this program run one supervised service behind the router at `endpoint`.
pub(crate) fn client_arguments(kind: &str, endpoint: &str, instance: &str, log: &str) -> Vec<String> {
    [kind, "--connect", endpoint, "--instance", instance, "--supervised", "--log", log]
        .map(String::from)
        .to_vec()
}

/// Runs the deployment until a signal, or until a process keeps failing.
pub(crate) async fn up(deployment: &Deployment, log: &str, mut shutdown: Shutdown) -> anyhow::Result<()> {
    let program = std::env::current_exe().context("cannot find this program's file")?;
    let mut running: Vec<Supervised> = Vec::new();
    let outcome = start_and_watch(&program, deployment, log, &mut running, &mut shutdown).await;
    // Services first, the router (started first) last.
    while let Some(process) = running.pop() {
        process.stop().await;
    }
    outcome
}

async fn start_and_watch(
    program: &Path,
    deployment: &Deployment,
    log: &str,
    running: &mut Vec<Supervised>,
    shutdown: &mut Shutdown,
) -> anyhow::Result<()> {
    let (router, endpoint) = Supervised::router(program, deployment.port, log).await?;
    running.push(router);
    let mut metrics_port = deployment.metrics_port;
    for (kind, instance) in deployment.processes() {
        let mut arguments = client_arguments(kind, &endpoint, &instance, log);
        arguments.extend(["--robot", &deployment.robot, "--world", &deployment.world].map(String::from));
        if let Some(namespace) = &deployment.namespace {
            arguments.extend(["--namespace".into(), namespace.clone()]);
        }
        if let Some(port) = metrics_port {
            arguments.extend(["--metrics".into(), format!("127.0.0.1:{port}")]);
            // The next port; of free ones the next free one.
            metrics_port = Some(if port == 0 { 0 } else { port.saturating_add(1) });
        }
        tokio::select! {
            started = Supervised::start(program, &instance, arguments) => running.push(started?.0),
            () = shutdown.requested() => return Ok(()),
        }
    }
    let processes = running.iter().map(Supervised::line).collect();
    Ready { processes, ..Ready::process("deployment".into(), vec![endpoint.clone()]) }.print();
    tracing::info!(%endpoint, processes = running.len(), "deployment is up; try: curionav status --connect {endpoint}");
    loop {
        tokio::select! {
            () = shutdown.requested() => return Ok(()),
            () = tokio::time::sleep(Duration::from_millis(100)) => {}
        }
        for process in running.iter_mut() {
            let Some(status) = process.child.try_wait()? else { continue };
            let status = status.to_string();
            tokio::select! {
                revived = revive(program, process, &status, deployment.max_restarts_per_minute) => revived?,
                () = shutdown.requested() => return Ok(()),
            }
        }
    }
}

async fn revive(program: &Path, process: &mut Supervised, status: &str, limit: usize) -> anyhow::Result<()> {
    let now = Instant::now();
    while process.restarts.front().is_some_and(|t| now.duration_since(*t) > Duration::from_secs(60)) {
        process.restarts.pop_front();
    }
    if process.restarts.len() >= limit {
        bail!("{} ended {} times within a minute (last: {status}); giving up", process.name, limit + 1);
    }
    tracing::warn!(process = %process.name, status, "ended, started again");
    process.restarts.push_back(now);
    // One that fails to start has ended again: the next round counts it.
    match Supervised::start(program, &process.name, process.arguments.clone()).await {
        Ok((mut fresh, _)) => {
            fresh.restarts = std::mem::take(&mut process.restarts);
            *process = fresh;
        }
        Err(error) => tracing::warn!(process = %process.name, error = format!("{error:#}"), "did not start"),
    }
    Ok(())
}
