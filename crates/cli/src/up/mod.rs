//! `curionav up`: router and services as processes on this machine, supervised.

mod certificates;
mod deployment;

use std::io::IsTerminal;
use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use curionav_deployment::supervised::{Supervised, client_arguments};
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::print::note;
use curionav_runtime::process::Ready;
use curionav_runtime::shutdown::{Shutdown, on_signals};
use futures_util::future::{OptionFuture, try_join_all};
use tokio::sync::Notify;

use certificates::Certificates;
use deployment::Deployment;

/// Start router and services as processes on this machine and supervise them.
#[derive(Debug, Args)]
pub(crate) struct UpOptions {
    /// Deployment file; see deploy/local.toml. Default: one of everything.
    #[arg(value_name = "DEPLOYMENT.toml")]
    deployment: Option<PathBuf>,
    /// Run everything over TLS, with the certificates and access rules in this folder. Missing certificates are made,
    /// and those near their end are renewed.
    #[arg(long, value_name = "DIR")]
    secure: Option<PathBuf>,
    /// Port of the router on 127.0.0.1; 0 takes a free one. Default: the one in the deployment file.
    #[arg(long, value_name = "P")]
    port: Option<u16>,
}

pub(crate) async fn run(options: UpOptions, log: &str) -> Result<u8, Exit> {
    let of_file = options.deployment.as_deref().map(Deployment::from_file);
    let mut deployment = of_file.transpose().map_err(Exit::bad_input)?.unwrap_or_default();
    deployment.port = options.port.unwrap_or(deployment.port);
    let secure = options.secure.as_deref();
    let certificates = secure.map(|folder| Certificates::of(&deployment, folder)).transpose()?;
    let shutdown = on_signals().map_err(Exit::network)?;
    // Told when the router has to start anew.
    let restart = Notify::new();
    let renewing = OptionFuture::from(certificates.as_ref().map(|all| all.keep_valid(&restart)));
    let supervised = supervise(&deployment, secure, log, &restart, shutdown);
    tokio::select! {
        outcome = supervised => outcome.map_err(Exit::network)?,
        Some(()) = renewing => {}
    }
    Ok(SUCCESS)
}

/// Runs the deployment until a signal, or until a process keeps failing.
async fn supervise(
    deployment: &Deployment,
    secure: Option<&Path>,
    log: &str,
    restart: &Notify,
    mut shutdown: Shutdown,
) -> anyhow::Result<()> {
    let program = std::env::current_exe().context("cannot find this program's file")?;
    let mut running: Vec<Supervised> = Vec::new();
    let outcome = tokio::select! {
        () = shutdown.requested() => Ok(()),
        outcome = start_and_watch(&program, deployment, secure, log, restart, &mut running) => outcome,
    };
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
    restart: &Notify,
    running: &mut Vec<Supervised>,
) -> anyhow::Result<()> {
    let (router, endpoint) = Supervised::router(program, deployment.port, &[], secure, log).await?;
    running.push(router);
    let mut metrics_port = deployment.metrics_port;
    for (kind, instance) in deployment.processes() {
        let mut arguments = client_arguments(kind.name(), &endpoint, &instance, secure, log);
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
        running.push(Supervised::start(program, &instance, arguments).await?.0);
    }
    let processes = running.iter().map(Supervised::line).collect();
    let endpoints = vec![endpoint.clone()];
    Ready { ready: "deployment".into(), endpoints, processes, ..Ready::default() }.print();
    if std::io::stderr().is_terminal() {
        note(format_args!(
            "The deployment is up; try: curionav status --connect {endpoint}. Ctrl-C ends it."
        ));
    }
    // Each by itself: one that takes long to be ready again keeps no other waiting.
    let limit = deployment.max_restarts_per_minute;
    let none = Notify::new();
    let restarts = std::iter::once(restart).chain(std::iter::repeat(&none));
    let kept = running.iter_mut().zip(restarts).map(|(one, restart)| one.keep_alive(program, limit, restart));
    try_join_all(kept).await.map(drop)
}
