//! One service as a process: arguments, signals, readiness, the end.

use std::io::Write;
use std::net::SocketAddr;
use std::path::{Path, PathBuf};
use std::pin::Pin;

use anyhow::Context;
use clap::Args;
use curionav_schemas::keys;
use curionav_security::name::Name;
use serde::{Deserialize, Serialize};
use zenoh::Session;

use crate::config::{ServiceConfig, read_toml};
use crate::exit::Exit;
use crate::fields::Fields;
use crate::heartbeat::{beat, notify};
use crate::map_store;
use crate::metrics_endpoint;
use crate::robot_limits::Base;
use crate::secure;
use crate::session::{self, SessionError};
use crate::shutdown::{Shutdown, on_end};

/// Where a client looks for a router unless told otherwise.
pub const DEFAULT_ENDPOINT: &str = "tcp/127.0.0.1:7447";
/// The same for links over TLS.
pub const DEFAULT_SECURE_ENDPOINT: &str = "tls/127.0.0.1:7447";

/// Where to look for a router if no endpoint is given. A Zenoh configuration names its own.
pub fn default_endpoint(config: &ServiceConfig) -> Option<String> {
    let has_file = config.zenoh_config.is_some() || std::env::var_os("ZENOH_CONFIG").is_some();
    match (&config.secure, has_file) {
        (_, true) => None,
        (Some(_), false) => Some(DEFAULT_SECURE_ENDPOINT.into()),
        (None, false) => Some(DEFAULT_ENDPOINT.into()),
    }
}

/// What every service takes on its command line.
#[derive(Debug, Clone, Default, Args)]
pub struct ServiceOptions {
    /// Configuration file; see deploy/service.toml. What is given here overrides it.
    #[arg(long, value_name = "F")]
    pub config: Option<PathBuf>,
    /// Router endpoint; may be given several times, the first that answers is used.
    #[arg(long, value_name = "ENDPOINT")]
    pub connect: Vec<String>,
    /// Folder of certificates, as `curionav secure` makes it: connect over TLS alone.
    #[arg(long, value_name = "DIR")]
    pub secure: Option<PathBuf>,
    /// Key prefix of the deployment.
    #[arg(long, value_name = "NS")]
    pub namespace: Option<String>,
    /// Name of this process within its role: a-z, 0-9, `_`, `-`.
    #[arg(long, value_name = "NAME")]
    pub instance: Option<String>,
    /// Robot it works for.
    #[arg(long, value_name = "NAME")]
    pub robot: Option<String>,
    /// World it simulates.
    #[arg(long, value_name = "NAME")]
    pub world: Option<String>,
    /// The base is simulated: it can do whatever a scenario says, and needs no limits of its own (driver).
    #[arg(long)]
    pub simulated_base: bool,
    /// Ask the driver that already drives the robot to stop it and to go first (driver).
    #[arg(long)]
    pub take_over: bool,
    /// Address for metrics in Prometheus's format, e.g. 0.0.0.0:9100; port 0 takes a free one. Default: none.
    #[arg(long, value_name = "ADDR:PORT")]
    pub metrics: Option<SocketAddr>,
    /// A planner of one's own to serve, which `curionav planner` sets.
    #[arg(skip)]
    pub planner: Option<String>,
    /// End when standard input closes (set by `curionav up`).
    #[arg(long, hide = true)]
    pub supervised: bool,
}

impl ServiceOptions {
    /// The configuration file of a service of `role` with what was given on the command line on top.
    pub fn configuration(&self, role: &str) -> anyhow::Result<ServiceConfig> {
        let mut config = match &self.config {
            Some(path) => read_toml(path)?,
            None => ServiceConfig::default(),
        };
        if !self.connect.is_empty() {
            config.connect.clone_from(&self.connect);
        }
        config.secure = self.secure.clone().or(config.secure);
        if config.connect.is_empty() {
            config.connect.extend(default_endpoint(&config));
        }
        config.instance = self.instance.clone().unwrap_or(config.instance);
        config.robot = self.robot.clone().unwrap_or(config.robot);
        config.world = self.world.clone().unwrap_or(config.world);
        config.namespace = self.namespace.clone().or(config.namespace);
        config.metrics = self.metrics.or(config.metrics);
        config.simulated_base |= self.simulated_base;
        config.take_over = self.take_over;
        config.planner.clone_from(&self.planner);
        config.directory = self.config.as_deref().and_then(Path::parent).map(Path::to_owned);
        let file = self.config.as_ref().map_or("the command line".into(), |path| path.display().to_string());
        config.check().context(file)?;
        if let Some(folder) = &config.secure {
            let name = Name::of_service(role, &config.robot, &config.world, &config.instance)?;
            config.certificates = vec![name];
            secure::check(folder, &config.certificates)?;
        }
        Ok(config)
    }
}

/// The line every process prints on standard output once it serves.
#[derive(Debug, Default, Serialize, Deserialize)]
pub struct Ready {
    /// What is ready, e.g. `cpc cpc-0`.
    pub ready: String,
    /// Where the router listens, if this process is a router or a deployment with one.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub endpoints: Vec<String>,
    /// Where its metrics are, if anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metrics: Option<SocketAddr>,
    /// The processes of a deployment.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub processes: Vec<ProcessLine>,
}

/// One process of a deployment.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub struct ProcessLine {
    /// Its instance name.
    pub name: String,
    /// Its process id.
    pub pid: u32,
    /// Where its metrics are, if anywhere.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub metrics: Option<SocketAddr>,
}

impl Ready {
    /// Prints the line, flushed. A closed standard output is only worth a warning.
    pub fn print(&self) {
        notify("READY=1");
        let mut out = std::io::stdout().lock();
        let printed = serde_json::to_string(self)
            .map_err(std::io::Error::from)
            .and_then(|line| writeln!(out, "{line}"))
            .and_then(|()| out.flush());
        if let Err(error) = printed {
            tracing::warn!(%error, "cannot say on standard output that this is ready");
        }
    }
}

/// Called by a service once it answers, with where its metrics are, if anywhere.
pub type OnReady = Box<dyn FnOnce(Option<SocketAddr>) + Send>;

/// What a service is started with.
pub struct Start<'a> {
    /// Its names and limits.
    pub config: &'a ServiceConfig,
    /// What it speaks over.
    pub session: &'a Session,
    /// Maps and what is derived from them, shared with the other services of the process.
    pub fields: &'a Fields,
    /// When it is to end.
    pub shutdown: Shutdown,
    /// Called once it answers.
    pub on_ready: OnReady,
}

/// A service at work. Boxed, so that its code is compiled once, with its own crate, and not again in every
/// program that runs it.
pub type Running<'a> = Pin<Box<dyn Future<Output = anyhow::Result<()>> + Send + 'a>>;

/// The `run` of a service: serves until the end is asked for.
pub type Service = fn(Start<'_>) -> Running<'_>;

/// Connects, runs `service` until it is asked to end, and closes the session.
///
/// # Errors
/// Bad input if arguments or configuration are wrong, the network if there is no session or the service fails.
pub async fn run_service(role: &str, options: &ServiceOptions, service: Service) -> Result<(), Exit> {
    let config = options.configuration(role).map_err(Exit::bad_input)?;
    if role == "driver" && matches!(config.base().map_err(Exit::bad_input)?, Base::Real(_)) {
        config.check_real_name().map_err(Exit::bad_input)?;
    }
    // A wrong address is said before any router is looked for.
    if let Some(address) = config.metrics {
        metrics_endpoint::listen(address).map_err(Exit::bad_input)?;
    }
    let (mut shutdown, questions) = on_end(options.supervised).context("signals").map_err(Exit::network)?;
    let session = connect(&config, options.supervised, &mut shutdown).await;
    let Some(session) = session? else { return Ok(()) };
    let ready = format!("{role} {}", config.instance);
    let on_ready: OnReady = Box::new(move |metrics| Ready { ready, metrics, ..Ready::default() }.print());
    let fields = map_store::fields(&session);
    let start = Start { config: &config, session: &session, fields: &fields, shutdown, on_ready };
    let status = keys::status(role, &config.instance).map_err(Exit::bad_input)?;
    // In one task, so that a service that hangs does not say that it works.
    let served = tokio::select! {
        served = service(start) => served,
        () = beat(&session, &status, questions) => Ok(()),
    };
    session::close(&session);
    served.map_err(Exit::network)
}

/// A session, or nothing if the end is asked for before there is one. A supervised process waits for a router that
/// is slow to start for as long as it takes: to end and be started again would make it no faster.
async fn connect(
    config: &ServiceConfig,
    supervised: bool,
    shutdown: &mut Shutdown,
) -> Result<Option<Session>, SessionError> {
    let opening = async {
        match supervised {
            true => session::awaited(|| session::client(config), |error| tracing::warn!("{error}")).await,
            false => session::client(config).await,
        }
    };
    tokio::select! {
        () = shutdown.requested() => Ok(None),
        opened = opening => opened.map(Some),
    }
}
