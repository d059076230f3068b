//! How commands reach a deployment.

use clap::Args;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::exit::Exit;
use curionav_runtime::session;
use zenoh::Session;

/// Where the deployment is.
#[derive(Debug, Clone, Args)]
pub(crate) struct ConnectOptions {
    /// Router endpoint, e.g. tcp/10.0.0.1:7447.
    #[arg(long, value_name = "ENDPOINT", default_value = "tcp/127.0.0.1:7447")]
    pub(crate) connect: String,
    /// Key prefix of the deployment.
    #[arg(long, value_name = "NS")]
    pub(crate) namespace: Option<String>,
}

impl ConnectOptions {
    pub(crate) fn config(&self) -> ServiceConfig {
        ServiceConfig {
            connect: vec![self.connect.clone()],
            namespace: self.namespace.clone(),
            ..ServiceConfig::default()
        }
    }

    pub(crate) async fn session(&self) -> Result<Session, Exit> {
        session::client(&self.config()).await.map_err(Exit::network)
    }
}
