//! `curionav router`: what services and clients connect to.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use curionav_runtime::denied;
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::heartbeat::beat;
use curionav_runtime::metrics::Metrics;
use curionav_runtime::process::Ready;
use curionav_runtime::session::{self, RouterSettings};
use curionav_runtime::shutdown::on_end;
use curionav_runtime::status::serve_status;
use curionav_schemas::keys;
use curionav_security::name::Name;

/// Run a Zenoh router, to which services and clients connect.
#[derive(Debug, Args)]
pub(crate) struct RouterOptions {
    /// Endpoint to listen on; port 0 takes a free one; may be given several times. Default: tcp/127.0.0.1:7447, for
    /// this machine alone, and with --secure tls/0.0.0.0:7447, for all networks. With --as router.ROBOT also a socket
    /// for the robot's own programs, such as unixsock-stream//run/curionav/robot.sock.
    #[arg(long, value_name = "ENDPOINT")]
    listen: Vec<String>,
    /// Another router to connect to; may be given several times. This router does not wait
    /// for it.
    #[arg(long, value_name = "ENDPOINT")]
    connect: Vec<String>,
    /// Folder of certificates made by `curionav secure`; accept clients over TLS only, each within its rights.
    #[arg(long, value_name = "DIR")]
    secure: Option<PathBuf>,
    /// Certificate from that folder to use: router, or router.ROBOT on a robot.
    #[arg(long = "as", value_name = "NAME", requires = "secure", default_value = "router")]
    certificate: Name,
    /// Zenoh configuration file (json5) instead of --listen and --connect; see deploy/router.json5.
    #[arg(long, value_name = "F", conflicts_with = "connect")]
    config: Option<PathBuf>,
    /// End when standard input closes (set by `curionav up`).
    #[arg(long, hide = true)]
    supervised: bool,
}

pub(crate) async fn run(options: RouterOptions) -> Result<u8, Exit> {
    let (mut shutdown, questions) = on_end(options.supervised).map_err(Exit::network)?;
    let default = if options.secure.is_some() { "tls/0.0.0.0:7447" } else { "tcp/127.0.0.1:7447" };
    let listen = if options.listen.is_empty() { vec![default.to_owned()] } else { options.listen };
    let settings = RouterSettings {
        listen: &listen,
        connect: &options.connect,
        file: options.config.as_deref(),
        secure: options.secure.as_deref().map(|folder| (folder, &options.certificate)),
    };
    let session = session::router(settings).await?;
    // No token: a router is no member of a deployment. Its version can be asked for.
    let mut metrics = Metrics::new("router", &session.zid().to_string(), None);
    if options.secure.is_some() {
        denied::register(&mut metrics, &session);
    }
    let metrics = Arc::new(metrics);
    let status = serve_status(&session, metrics, Arc::default(), Vec::new).map_err(Exit::network)?;
    let endpoints = session::locators(&session).await;
    Ready { ready: "router".into(), endpoints, ..Ready::default() }.print();
    let own = keys::status("router", &session.zid().to_string()).map_err(Exit::failed)?;
    tokio::select! {
        () = shutdown.requested() => {}
        () = beat(&session, &own, questions) => {}
    }
    drop(status);
    session::close(&session);
    Ok(SUCCESS)
}
