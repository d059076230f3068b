//! The trajectory generators as a service.

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::process::OnReady;
use curionav_runtime::shutdown::Shutdown;
use curionav_schemas::GenerateRequest;
use zenoh::Session;

use crate::generator::{ROLE, answer};
use crate::replica_service::{self, is_over};

/// Serves until `shutdown`. A request for no growth warms the replica: it is answered once every field the request
/// would need is there. `on_ready` is called when requests are answered.
pub async fn run(
    config: &ServiceConfig,
    session: &Session,
    shutdown: Shutdown,
    on_ready: OnReady,
) -> anyhow::Result<()> {
    let instance = config.instance.clone();
    let help = "Candidates offered";
    replica_service::run(ROLE, config, session, shutdown, on_ready, help, move |fields, request, came| {
        let request: GenerateRequest = request;
        let reply = answer(&instance, fields, &request, &|| is_over(came, request.budget_ms))?;
        let count = reply.candidates.count as usize;
        Ok((reply, count))
    })
    .await
}
