//! The trajectory generator: grows a robot's tree and offers its branches as candidates (Alg. 1).
//!
//! Stateless: the tree comes with the request and goes with the reply, so any replica can take over.

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::fields::Fields;
use curionav_runtime::generator;
use curionav_runtime::metrics::{Counter, Metrics};
use curionav_runtime::process::{OnReady, Running};
use curionav_runtime::serve::{Arrival, serve};
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::status::announce_service;
use curionav_schemas::{GenerateRequest, keys};
use zenoh::Session;

/// Serves until `shutdown`; `on_ready` is called once requests are answered.
pub fn run<'a>(
    config: &'a ServiceConfig,
    session: &'a Session,
    shutdown: Shutdown,
    on_ready: OnReady,
) -> Running<'a> {
    Box::pin(serve_generation(config, session, shutdown, on_ready))
}

async fn serve_generation(
    config: &ServiceConfig,
    session: &Session,
    mut shutdown: Shutdown,
    on_ready: OnReady,
) -> anyhow::Result<()> {
    let fields = Fields::new(session);
    let offered: Counter = Counter::default();
    let counted = offered.clone();
    let (instance, answering) = (config.instance.clone(), fields.clone());
    let handler = move |request: GenerateRequest, arrival: Arrival| {
        let reply =
            generator::answer(&instance, &answering, &request, &|| arrival.is_over(request.budget_ms))?;
        counted.inc_by(reply.candidates.count as u64);
        Ok(reply)
    };
    let key = keys::generate(&config.instance)?;
    let server = serve(session, &key, config.slots, config.queue, handler)?;
    let mut metrics = Metrics::of_pool(generator::ROLE, config);
    metrics.count("candidates", "Candidates offered", offered);
    let warmed = move || fields.warmed();
    let announced = announce_service(config, &[("data", session)], metrics, server.counts(), warmed)?;
    on_ready(announced.metrics_address());
    tracing::info!(instance = %config.instance, "trajectory generator ready");
    shutdown.requested().await;
    drop(announced);
    Ok(())
}
