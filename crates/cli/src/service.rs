//! One service a process, and the router.

use std::sync::Arc;

use curionav_runtime::metrics::Metrics;
use curionav_runtime::process::{Ready, Service, ServiceOptions, end, run_service};
use curionav_runtime::session;
use curionav_runtime::shutdown::on_signals;
use curionav_runtime::status::serve_status;

use crate::arguments::{Command, RouterOptions, UpOptions};
use crate::exit::{BAD_INPUT, Exit, SUCCESS};
use crate::supervise::{Deployment, up as supervise};

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
    /// All of them, one each: what one robot in one simulated world needs.
    pub(crate) const ALL: [Self; 7] = [
        Self::Driver,
        Self::Localizer,
        Self::Generator,
        Self::Cpc,
        Self::Hccdm,
        Self::Arbiter,
        Self::Simulator,
    ];

    /// The service a command runs, if that is what it does.
    pub(crate) fn of(command: &Command) -> Option<Self> {
        Some(match command {
            Command::Generator(_) => Self::Generator,
            Command::Cpc(_) => Self::Cpc,
            Command::Hccdm(_) => Self::Hccdm,
            Command::Arbiter(_) => Self::Arbiter,
            Command::Localizer(_) => Self::Localizer,
            Command::Driver(_) => Self::Driver,
            Command::Simulator(_) => Self::Simulator,
            _ => return None,
        })
    }

    pub(crate) fn name(self) -> &'static str {
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

    /// What runs it.
    pub(crate) fn service(self) -> Service {
        match self {
            Self::Generator => curionav_trajectory_generator::run,
            Self::Cpc => curionav_cpc_evaluator::run,
            Self::Hccdm => curionav_hccdm_evaluator::run,
            Self::Arbiter => curionav_arbiter::run,
            Self::Localizer => curionav_localizer::run,
            Self::Driver => curionav_driver::run,
            Self::Simulator => curionav_simulator::run,
        }
    }
}

pub(crate) async fn one(kind: Kind, options: ServiceOptions) -> Result<u8, Exit> {
    run(kind.name(), &options, kind.service()).await
}

pub(crate) async fn echo(options: ServiceOptions) -> Result<u8, Exit> {
    run("echo", &options, curionav_runtime::echo::run).await
}

async fn run(role: &str, options: &ServiceOptions, service: Service) -> Result<u8, Exit> {
    match run_service(role, options, service).await {
        Ok(()) => Ok(SUCCESS),
        Err(error) if error.exit_code() == BAD_INPUT => Err(Exit::bad_input(error.into())),
        Err(error) => Err(Exit::network(error.into())),
    }
}

pub(crate) async fn router(options: RouterOptions) -> Result<u8, Exit> {
    let mut shutdown = end(options.supervised).map_err(|e| Exit::network(e.into()))?;
    let session = session::router(&options.listen, &options.connect, options.config.as_deref())
        .await
        .map_err(|e| Exit::network(e.into()))?;
    // No token: a router is no member of a deployment. Its version can be asked for.
    let metrics = Arc::new(Metrics::new("router", &session.zid().to_string(), None));
    let status =
        serve_status(&session, metrics, Arc::default(), Vec::new).map_err(|e| Exit::network(e.into()))?;
    Ready::process("router".into(), session::locators(&session).await).print();
    shutdown.requested().await;
    drop(status);
    session::close(&session);
    Ok(SUCCESS)
}

pub(crate) async fn up(options: UpOptions, log: &str) -> Result<u8, Exit> {
    let deployment =
        Deployment::from_file(&options.deployment).map_err(Exit::bad_input)?.with_port(options.port);
    let shutdown = on_signals().map_err(|e| Exit::network(e.into()))?;
    supervise(&deployment, log, shutdown).await.map_err(Exit::network)?;
    Ok(SUCCESS)
}
