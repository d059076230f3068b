//! `curionav up`: router and services as processes on this machine, supervised.

use std::path::{Path, PathBuf};

use anyhow::{Context, ensure};
use clap::Args;
use curionav_deployment::service_kind::Kind;
use curionav_deployment::supervised::{Supervised, client_arguments};
use curionav_runtime::config::{ServiceConfig, read_toml};
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::process::Ready;
use curionav_runtime::shutdown::{Shutdown, on_signals};
use futures_util::future::try_join_all;
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

/// Processes per kind; tracker and simulator may be 0 (a robot that has its own) or 1, the others 1 to 64.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(default, deny_unknown_fields)]
struct Replicas {
    generator: usize,
    cpc: usize,
    cnc: usize,
    tracker: usize,
    simulator: usize,
}

impl Default for Replicas {
    fn default() -> Self {
        Self { generator: 1, cpc: 1, cnc: 1, tracker: 1, simulator: 1 }
    }
}

impl Replicas {
    fn of(&self, kind: Kind) -> usize {
        match kind {
            Kind::Generator => self.generator,
            Kind::Cpc => self.cpc,
            Kind::Cnc => self.cnc,
            Kind::Tracker => self.tracker,
            Kind::Simulator => self.simulator,
            // They belong to the one robot.
            Kind::Driver | Kind::Localizer | Kind::Arbiter => 1,
        }
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
        let deployment: Self = read_toml(path)?;
        deployment.check().with_context(|| path.display().to_string())?;
        Ok(deployment)
    }

    fn check(&self) -> anyhow::Result<()> {
        let Self { robot, world, .. } = self.clone();
        ServiceConfig { robot, world, ..ServiceConfig::default() }.check()?;
        for &kind in Kind::ALL {
            let may_be_absent = matches!(kind, Kind::Tracker | Kind::Simulator);
            let (least, most) = if may_be_absent { (0, 1) } else { (1, 64) };
            let (field, count) = (kind.name(), self.replicas.of(kind));
            let is_allowed = (least..=most).contains(&count);
            ensure!(is_allowed, "replicas.{field}: is {count}; give {least} to {most}");
        }
        Ok(())
    }

    /// (subcommand, instance) of every service process.
    fn processes(&self) -> impl Iterator<Item = (&'static str, String)> {
        let of_kind = |kind: Kind| (0..self.replicas.of(kind)).map(move |i| (kind.name(), i));
        Kind::ALL.iter().copied().flat_map(of_kind).map(|(kind, i)| (kind, format!("{kind}-{i}")))
    }
}

/// Runs the deployment until a signal, or until a process keeps failing.
async fn supervise(deployment: &Deployment, log: &str, mut shutdown: Shutdown) -> anyhow::Result<()> {
    let program = std::env::current_exe().context("cannot find this program's file")?;
    let mut running: Vec<Supervised> = Vec::new();
    let outcome = start_and_watch(&program, deployment, log, &mut running, &mut shutdown).await;
    // The router, which was started first, ends after the services.
    let services = running.split_off(running.len().min(1));
    Supervised::stop_all(services).await;
    Supervised::stop_all(running).await;
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
    let endpoints = vec![endpoint.clone()];
    Ready { ready: "deployment".into(), endpoints, processes, ..Ready::default() }.print();
    tracing::info!(%endpoint, processes = running.len(), "deployment is up; try: curionav status --connect {endpoint}");
    // Each by itself: one that takes long to be ready again keeps no other waiting.
    let limit = deployment.max_restarts_per_minute;
    tokio::select! {
        () = shutdown.requested() => Ok(()),
        kept = try_join_all(running.iter_mut().map(|one| one.keep_alive(program, limit))) => kept.map(|_| ()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wrong_deployment_is_refused_by_field_with_the_range() {
        for (text, fault) in [
            ("replicas.simulator = 2", "replicas.simulator: is 2; give 0 to 1"),
            ("replicas.cnc = 65", "replicas.cnc: is 65; give 1 to 64"),
            ("robot = \"A B\"", "robot: name `A B` must be 1 to 64 of the characters a-z, 0-9, `_` and `-`"),
        ] {
            let deployment: Deployment = toml::from_str(text).unwrap();
            assert_eq!(format!("{:#}", deployment.check().unwrap_err()), fault);
        }
    }
}
