//! The trajectory generators as a service.

use std::time::{Duration, Instant};

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::metrics::{Counter, Metrics};
use curionav_runtime::process::{OnReady, Running};
use curionav_runtime::serve::serve;
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::status::announce_service;
use curionav_schemas::{GenerateRequest, keys};
use zenoh::Session;

use crate::fields::Fields;
use crate::generator;

/// Serves until `shutdown`. A request for no growth warms the replica: it is answered once every field the request
/// would need is there. `on_ready` is called when requests are answered.
pub fn run<'a>(
    config: &'a ServiceConfig,
    session: &'a Session,
    mut shutdown: Shutdown,
    on_ready: OnReady,
) -> Running<'a> {
    Box::pin(async move {
        let fields = Fields::new(session);
        let offered: Counter = Counter::default();
        let counted = offered.clone();
        let (instance, answering) = (config.instance.clone(), fields.clone());
        let handler = move |request: GenerateRequest, came: Instant| {
            let budget = Duration::from_millis(request.budget_ms.into());
            let reply = generator::answer(&instance, &answering, &request, &|| came.elapsed() > budget)?;
            counted.inc_by(reply.candidates.count as u64);
            Ok(reply)
        };
        let key = keys::questions(keys::GENERATOR, &config.instance)?;
        let server = serve(session, &key, config.slots, config.queue, handler)?;
        let mut metrics = Metrics::of_pool(generator::ROLE, config);
        metrics.count("candidates", "Candidates offered", offered);
        let prepared = move || fields.prepared();
        let announced = announce_service(config, &[("data", session)], metrics, server.counts(), prepared)?;
        on_ready(announced.metrics_address());
        tracing::info!(instance = %config.instance, "trajectory generator ready");
        shutdown.requested().await;
        drop(announced);
        Ok(())
    })
}
