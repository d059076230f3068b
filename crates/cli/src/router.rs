//! `curionav router`: what services and clients connect to.

use std::path::PathBuf;
use std::sync::Arc;

use clap::Args;
use curionav_runtime::exit::{Exit, SUCCESS};
use curionav_runtime::metrics::Metrics;
use curionav_runtime::process::Ready;
use curionav_runtime::session;
use curionav_runtime::shutdown::on_end;
use curionav_runtime::status::serve_status;

/// Run a Zenoh router: what services and clients connect to.
#[derive(Debug, Args)]
pub(crate) struct RouterOptions {
    /// Endpoint to listen on; port 0 takes a free one.
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/0.0.0.0:7447")]
    listen: String,
    /// Another router to link with; may be given several times. This router does not wait
    /// for it: it serves whether the other is there or not.
    #[arg(long, value_name = "ENDPOINT")]
    connect: Vec<String>,
    /// Zenoh configuration file (json5) instead of --listen and --connect; see deploy/router.json5.
    #[arg(long, value_name = "F", conflicts_with = "connect")]
    config: Option<PathBuf>,
    /// End when standard input closes (set by `curionav up`).
    #[arg(long, hide = true)]
    supervised: bool,
}

pub(crate) async fn run(options: RouterOptions) -> Result<u8, Exit> {
    let mut shutdown = on_end(options.supervised).map_err(Exit::network)?;
    let session = session::router(&options.listen, &options.connect, options.config.as_deref())
        .await
        .map_err(Exit::network)?;
    // No token: a router is no member of a deployment. Its version can be asked for.
    let metrics = Arc::new(Metrics::new("router", &session.zid().to_string(), None));
    let status = serve_status(&session, metrics, Arc::default(), Vec::new).map_err(Exit::network)?;
    let endpoints = session::locators(&session).await;
    Ready { ready: "router".into(), endpoints, ..Ready::default() }.print();
    shutdown.requested().await;
    drop(status);
    session::close(&session);
    Ok(SUCCESS)
}
