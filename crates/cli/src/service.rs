//! One service a process, and the router.

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::session;
use curionav_runtime::shutdown::{Shutdown, on_signals, shutdown};

use crate::arguments::{RouterOptions, ServiceOptions, UpOptions};
use crate::exit::{Exit, SUCCESS};
use crate::supervise::{Deployment, Ready, end_with_supervisor, print_ready, up as supervise};

/// The services there are.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    Generator,
    Cpc,
    Hccdm,
    Arbiter,
    Localizer,
    Driver,
    Simulator,
}

impl Kind {
    fn name(self) -> &'static str {
        match self {
            Self::Generator => "generator",
            Self::Cpc => "cpc",
            Self::Hccdm => "hccdm",
            Self::Arbiter => "arbiter",
            Self::Localizer => "localizer",
            Self::Driver => "driver",
            Self::Simulator => "simulator",
        }
    }

    /// Runs the service over `session`; `on_ready` is called once it serves.
    pub(crate) async fn run(
        self,
        config: &ServiceConfig,
        session: &zenoh::Session,
        shutdown: Shutdown,
        on_ready: impl FnOnce(),
    ) -> anyhow::Result<()> {
        match self {
            Self::Generator => curionav_trajectory_generator::run(config, session, shutdown, on_ready).await,
            Self::Cpc => curionav_cpc_evaluator::run(config, session, shutdown, on_ready).await,
            Self::Hccdm => curionav_hccdm_evaluator::run(config, session, shutdown, on_ready).await,
            Self::Arbiter => curionav_arbiter::run(config, session, shutdown, on_ready).await,
            Self::Localizer => curionav_localizer::run(config, session, shutdown, on_ready).await,
            Self::Driver => curionav_driver::run(config, session, shutdown, on_ready).await,
            Self::Simulator => curionav_simulator::run(config, session, shutdown, on_ready).await,
        }
    }
}

/// The end asked for by a signal or, under supervision, by the supervisor's end.
fn end(supervised: bool) -> Result<Shutdown, Exit> {
    let signals = on_signals().map_err(|e| Exit::network(e.into()))?;
    if !supervised {
        return Ok(signals);
    }
    let (trigger, token) = shutdown();
    let (orphaned, mut supervisor_gone) = shutdown();
    end_with_supervisor(orphaned);
    let mut signals = signals;
    tokio::spawn(async move {
        tokio::select! {
            () = signals.requested() => {}
            () = supervisor_gone.requested() => {}
        }
        trigger.fire();
    });
    Ok(token)
}

fn announce_ready(name: String, endpoints: Vec<String>) {
    if let Err(error) = print_ready(&Ready { ready: name, endpoints, processes: Vec::new() }) {
        tracing::warn!(%error, "standard output is closed");
    }
}

pub(crate) async fn one(kind: Kind, options: ServiceOptions) -> Result<u8, Exit> {
    let config = configuration(&options)?;
    let shutdown = end(options.supervised)?;
    let session = session::client(&config).await.map_err(|e| Exit::network(e.into()))?;
    let name = format!("{} {}", kind.name(), config.instance);
    let served = kind.run(&config, &session, shutdown, || announce_ready(name, Vec::new())).await;
    session::close(&session);
    served.map_err(Exit::network)?;
    Ok(SUCCESS)
}

fn configuration(options: &ServiceOptions) -> Result<ServiceConfig, Exit> {
    let mut config = match &options.config {
        Some(path) => ServiceConfig::from_file(path).map_err(|e| Exit::bad_input(e.into()))?,
        None => ServiceConfig::default(),
    };
    if !options.connect.is_empty() {
        config.connect.clone_from(&options.connect);
    }
    if config.connect.is_empty() && config.zenoh_config.is_none() && std::env::var_os("ZENOH_CONFIG").is_none() {
        config.connect.push("tcp/127.0.0.1:7447".into());
    }
    let replace = |field: &mut String, value: &Option<String>| {
        if let Some(value) = value {
            field.clone_from(value);
        }
    };
    replace(&mut config.instance, &options.instance);
    replace(&mut config.robot, &options.robot);
    replace(&mut config.world, &options.world);
    config.namespace = options.namespace.clone().or(config.namespace);
    for (field, name) in [("instance", &config.instance), ("robot", &config.robot), ("world", &config.world)] {
        curionav_schemas::keys::check_id(name)
            .map_err(|e| Exit::bad_input(anyhow::Error::from(e).context(field)))?;
    }
    Ok(config)
}

pub(crate) async fn router(options: RouterOptions) -> Result<u8, Exit> {
    let mut shutdown = end(options.supervised)?;
    let session =
        session::router(&options.listen, options.config.as_deref()).await.map_err(|e| Exit::network(e.into()))?;
    announce_ready("router".into(), session::locators(&session).await);
    shutdown.requested().await;
    session::close(&session);
    Ok(SUCCESS)
}

pub(crate) async fn up(options: UpOptions, log: &str) -> Result<u8, Exit> {
    let deployment = Deployment::from_file(&options.deployment).map_err(Exit::bad_input)?.with_port(options.port);
    let shutdown = on_signals().map_err(|e| Exit::network(e.into()))?;
    supervise(&deployment, log, shutdown).await.map_err(Exit::network)?;
    Ok(SUCCESS)
}
