//! `curionav up`: router and services as processes on this machine, supervised.

use std::path::{Path, PathBuf};
use std::time::Duration;

use anyhow::{Context, anyhow, bail};
use clap::Args;
use curionav_deployment::supervised::{Supervised, client_arguments};
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::process::Ready;
use curionav_runtime::shutdown::{Shutdown, on_signals};
use serde::Deserialize;

/// Start router and services as processes on this machine and supervise them.
#[derive(Debug, Args)]
pub(crate) struct UpOptions {
    /// Deployment file; see deploy/local.toml.
    #[arg(value_name = "DEPLOYMENT.toml")]
    deployment: PathBuf,
    /// Port of the router on 127.0.0.1, 0 for a free one. Default: the deployment's.
    #[arg(long, value_name = "P")]
    port: Option<u16>,
}

pub(crate) async fn run(options: UpOptions, log: &str) -> Result<u8, Exit> {
    let mut deployment = Deployment::from_file(&options.deployment).map_err(Exit::bad_input)?;
    deployment.port = options.port.unwrap_or(deployment.port);
    let shutdown = on_signals().map_err(Exit::network)?;
    supervise(&deployment, log, shutdown).await.map_err(Exit::network)?;
    Ok(SUCCESS)
}

/// What `curionav up` starts. All fields have defaults: an empty file is one of everything.
#[derive(Debug, Clone, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Deployment {
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
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Replicas {
    generator: usize,
    cpc: usize,
    cnc: usize,
    simulator: usize,
}

impl Default for Replicas {
    fn default() -> Self {
        Self { generator: 1, cpc: 1, cnc: 1, simulator: 1 }
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
    fn from_file(path: &Path) -> anyhow::Result<Self> {
        let text =
            std::fs::read_to_string(path).with_context(|| format!("cannot read {}", path.display()))?;
        let path = path.display();
        let deployment: Self = toml::from_str(&text)
            .map_err(|e| anyhow!("{path}: {}", curionav_runtime::config::describe_toml_error(&text, &e)))?;
        let Replicas { generator, cpc, cnc, .. } = deployment.replicas;
        for (field, count) in [("generator", generator), ("cpc", cpc), ("cnc", cnc)] {
            if count == 0 || count > 64 {
                bail!("{path}: replicas.{field} must be 1 to 64, found {count}");
            }
        }
        Ok(deployment)
    }

    /// (subcommand, instance) of every service process.
    fn processes(&self) -> impl Iterator<Item = (&'static str, String)> + use<> {
        let Replicas { generator, cpc, cnc, simulator } = self.replicas;
        let counts = [
            ("driver", 1),
            ("localizer", 1),
            ("generator", generator),
            ("cpc", cpc),
            ("cnc", cnc),
            ("arbiter", 1),
            ("simulator", simulator),
        ];
        counts.into_iter().flat_map(|(kind, count)| (0..count).map(move |i| (kind, format!("{kind}-{i}"))))
    }
}

/// Runs the deployment until a signal, or until a process keeps failing.
async fn supervise(deployment: &Deployment, log: &str, mut shutdown: Shutdown) -> anyhow::Result<()> {
    let program = std::env::current_exe().context("cannot find this program's file")?;
    let mut running: Vec<Supervised> = Vec::new();
    let outcome = start_and_watch(&program, deployment, log, &mut running, &mut shutdown).await;
    // Services first, all at once, the router (started first) last.
    running.iter_mut().skip(1).for_each(Supervised::ask_to_end);
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
            tokio::select! {
                revived = process.revive(program, deployment.max_restarts_per_minute) => revived?,
                () = shutdown.requested() => return Ok(()),
            }
        }
    }
}
