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
#[cfg(feature = "tls")]
use curionav_security::folder::{Folder, LIFETIME_DAYS, days};
#[cfg(feature = "tls")]
use curionav_security::name::Name;
use futures_util::future::try_join_all;
use serde::Deserialize;

/// Start router and services as processes on this machine and supervise them.
#[derive(Debug, Args)]
pub(crate) struct UpOptions {
    /// Deployment file; see deploy/local.toml. Default: one of everything.
    #[arg(value_name = "DEPLOYMENT.toml")]
    deployment: Option<PathBuf>,
    /// Run everything over TLS, with the certificates and access rules of this folder: what is absent is made, and
    /// what is due is renewed.
    #[arg(long, value_name = "DIR")]
    secure: Option<PathBuf>,
    /// Port of the router on 127.0.0.1, 0 for a free one. Default: the deployment's.
    #[arg(long, value_name = "P")]
    port: Option<u16>,
}

pub(crate) async fn run(options: UpOptions, log: &str) -> Result<u8, Exit> {
    let of_file = options.deployment.as_deref().map(Deployment::from_file);
    let mut deployment = of_file.transpose().map_err(Exit::bad_input)?.unwrap_or_default();
    deployment.port = options.port.unwrap_or(deployment.port);
    if let Some(folder) = &options.secure {
        deployment.certify(folder)?;
    }
    let shutdown = on_signals().map_err(Exit::network)?;
    supervise(&deployment, options.secure.as_deref(), log, shutdown).await.map_err(Exit::network)?;
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
    /// The driver's configuration file, with the robot's own limits; beside the deployment file if it is relative. A
    /// deployment with a simulator needs none.
    driver_config: Option<PathBuf>,
    /// Configuration file of the gateway to a robot of ROS 2, which is then started; beside the deployment file if it is
    /// relative. The driver has the same file unless `driver_config` names another.
    ros2_config: Option<PathBuf>,
    /// How many processes of each kind.
    replicas: Replicas,
    /// Restarts of one process within a minute before the deployment is given up.
    max_restarts_per_minute: usize,
}

/// Processes per kind; tracker and simulator may be 0 (a robot that has its own) or 1, the evaluator of a term that the
/// default planner lacks 0 to 64, the others 1 to 64.
#[derive(Debug, Clone, Copy, Deserialize)]
#[serde(default, deny_unknown_fields, rename_all = "kebab-case")]
struct Replicas {
    generator: usize,
    cpc: usize,
    cpc_occluded: usize,
    cnc: usize,
    tracker: usize,
    simulator: usize,
}

impl Default for Replicas {
    fn default() -> Self {
        Self { generator: 1, cpc: 1, cpc_occluded: 0, cnc: 1, tracker: 1, simulator: 1 }
    }
}

impl Replicas {
    fn of(&self, kind: Kind) -> usize {
        match kind {
            Kind::Generator => self.generator,
            Kind::Cpc => self.cpc,
            Kind::CpcOccluded => self.cpc_occluded,
            Kind::Cnc => self.cnc,
            Kind::Tracker => self.tracker,
            Kind::Simulator => self.simulator,
            // They belong to the one robot; whether there is a gateway, its file says.
            Kind::Driver | Kind::Localizer | Kind::Arbiter | Kind::Ros2Gateway => 1,
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
            driver_config: None,
            ros2_config: None,
            replicas: Replicas::default(),
            max_restarts_per_minute: 5,
        }
    }
}

impl Deployment {
    fn from_file(path: &Path) -> anyhow::Result<Self> {
        let mut deployment: Self = read_toml(path)?;
        let beside = path.parent().unwrap_or(Path::new(""));
        deployment.driver_config = deployment.driver_config.map(|file| beside.join(file));
        deployment.ros2_config = deployment.ros2_config.map(|file| beside.join(file));
        deployment.check().with_context(|| path.display().to_string())?;
        Ok(deployment)
    }

    fn check(&self) -> anyhow::Result<()> {
        let Self { robot, world, .. } = self.clone();
        ServiceConfig { robot, world, ..ServiceConfig::default() }.check()?;
        for &kind in Kind::ALL {
            let (least, most) = match kind {
                Kind::Tracker | Kind::Simulator => (0, 1),
                Kind::CpcOccluded => (0, 64),
                _ => (1, 64),
            };
            let (field, count) = (kind.name(), self.replicas.of(kind));
            let is_allowed = (least..=most).contains(&count);
            ensure!(is_allowed, "replicas.{field}: is {count}; give {least} to {most}");
        }
        ensure!(
            self.driver_config.is_some() || self.ros2_config.is_some() || self.replicas.simulator == 1,
            "driver_config: is missing; without a simulator the base is a real one: name the driver's configuration \
             file, which says the robot's own limits (or `simulated_base = true` for a simulator elsewhere)"
        );
        ensure!(
            self.ros2_config.is_none() || self.replicas.simulator == 0,
            "replicas.simulator: is 1, and ros2_config names another base; give 0"
        );
        Ok(())
    }

    /// What tells the driver which base it commands, and the gateway which robot it joins.
    fn file_arguments(&self, kind: &str) -> Vec<String> {
        let of_file = |file: &PathBuf| vec!["--config".into(), file.display().to_string()];
        if kind == Kind::Driver.name() {
            let file = self.driver_config.as_ref().or(self.ros2_config.as_ref());
            return file.map_or_else(|| vec!["--simulated-base".into()], of_file);
        }
        let gateway = self.ros2_config.as_ref().filter(|_| kind == Kind::Ros2Gateway.name());
        gateway.map(of_file).unwrap_or_default()
    }

    /// Makes the certificates that it needs and that are absent: of the router, of every process, and of the people
    /// who use it. Renews those of which less than a third of the time is left.
    #[cfg(feature = "tls")]
    fn certify(&self, directory: &Path) -> Result<(), Exit> {
        let folder = Folder::new(directory);
        if !folder.is_initialised() {
            folder.init(self.namespace.as_deref()).map_err(Exit::bad_input)?;
        }
        let namespace = folder.namespace().map_err(Exit::bad_input)?;
        if namespace != self.namespace {
            let shown = |namespace: &Option<String>| namespace.clone().unwrap_or_else(|| "none".into());
            return Err(Exit::bad_input(anyhow::anyhow!(
                "{}: its rules are for the namespace `{}`, and this deployment's is `{}`; choose another folder",
                directory.display(),
                shown(&namespace),
                shown(&self.namespace)
            )));
        }
        let processes = self.processes();
        let names =
            processes.map(|(kind, instance)| Name::of_service(kind, &self.robot, &self.world, &instance));
        let mut names: Vec<Name> = names.collect::<Result<_, _>>().map_err(Exit::bad_input)?;
        let mut more = vec![Name::new("router", &[]), Name::new("viewer", &[]), Name::new("operator", &[])];
        if self.replicas.simulator > 0 {
            more.extend([Name::new("experimenter", &[]), Name::new("crowd", &[&self.world])]);
        }
        names.extend(more.into_iter().collect::<Result<Vec<_>, _>>().map_err(Exit::bad_input)?);
        names
            .iter()
            .try_for_each(|name| folder.keep_valid(name, days(LIFETIME_DAYS)))
            .map_err(Exit::bad_input)
    }

    #[cfg(not(feature = "tls"))]
    fn certify(&self, _: &Path) -> Result<(), Exit> {
        Err(crate::left_out::left_out("tls"))
    }

    /// (subcommand, instance) of every service process.
    fn processes(&self) -> impl Iterator<Item = (&'static str, String)> {
        let of_kind = |kind: Kind| (0..self.replicas.of(kind)).map(move |i| (kind.name(), i));
        let has_gateway = self.ros2_config.is_some();
        let kinds = Kind::ALL.iter().copied().filter(move |kind| has_gateway || *kind != Kind::Ros2Gateway);
        kinds.flat_map(of_kind).map(|(kind, i)| (kind, format!("{kind}-{i}")))
    }
}

/// Runs the deployment until a signal, or until a process keeps failing.
async fn supervise(
    deployment: &Deployment,
    secure: Option<&Path>,
    log: &str,
    mut shutdown: Shutdown,
) -> anyhow::Result<()> {
    let program = std::env::current_exe().context("cannot find this program's file")?;
    let mut running: Vec<Supervised> = Vec::new();
    let outcome = start_and_watch(&program, deployment, secure, log, &mut running, &mut shutdown).await;
    // The router, which was started first, ends after the services.
    let services = running.split_off(running.len().min(1));
    Supervised::stop_all(services).await;
    Supervised::stop_all(running).await;
    outcome
}

async fn start_and_watch(
    program: &Path,
    deployment: &Deployment,
    secure: Option<&Path>,
    log: &str,
    running: &mut Vec<Supervised>,
    shutdown: &mut Shutdown,
) -> anyhow::Result<()> {
    let (router, endpoint) = Supervised::router(program, deployment.port, secure, log).await?;
    running.push(router);
    let mut metrics_port = deployment.metrics_port;
    for (kind, instance) in deployment.processes() {
        let mut arguments = client_arguments(kind, &endpoint, &instance, secure, log);
        arguments.extend(["--robot", &deployment.robot, "--world", &deployment.world].map(String::from));
        if let Some(namespace) = &deployment.namespace {
            arguments.extend(["--namespace".into(), namespace.clone()]);
        }
        arguments.extend(deployment.file_arguments(kind));
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
            ("replicas.cpc-occluded = 65", "replicas.cpc-occluded: is 65; give 0 to 64"),
            ("replicas.cnc = 65", "replicas.cnc: is 65; give 1 to 64"),
            (
                "replicas.simulator = 0",
                "driver_config: is missing; without a simulator the base is a real one: name the driver's configuration file, which says the robot's own limits (or `simulated_base = true` for a simulator elsewhere)",
            ),
            (
                "ros2_config = \"r1.toml\"",
                "replicas.simulator: is 1, and ros2_config names another base; give 0",
            ),
            ("robot = \"A B\"", "robot: name `A B` must be 1 to 64 of the characters a-z, 0-9, `_` and `-`"),
        ] {
            let deployment: Deployment = toml::from_str(text).unwrap();
            assert_eq!(format!("{:#}", deployment.check().unwrap_err()), fault);
        }
    }
}
