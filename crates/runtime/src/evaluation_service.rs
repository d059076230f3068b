//! One evaluator as a service: what the CPC and the HCCDM evaluator have in common.

use std::time::Instant;

use curionav_schemas::{EvaluateRequest, Reject, RejectCode, Scores, keys};
use zenoh::Session;

use crate::config::ServiceConfig;
use crate::convert;
use crate::evaluators::evaluator;
use crate::fields::Fields;
use crate::metrics::{Counter, Metrics};
use crate::process::OnReady;
use crate::serve::{Arrival, serve};
use crate::shutdown::Shutdown;
use crate::status::announce_service;

/// Serves `metric` until `shutdown`. A request without candidates warms the replica: it is answered
/// once every field the request would need is there. `on_ready` is called when requests are answered.
pub async fn run(
    metric: &'static str,
    config: &ServiceConfig,
    session: &Session,
    mut shutdown: Shutdown,
    on_ready: OnReady,
) -> anyhow::Result<()> {
    let fields = Fields::new(session);
    let (instance, slots) = (config.instance.clone(), config.slots);
    let key = keys::evaluate(metric, &instance)?;
    let answering = fields.clone();
    let scored: Counter = Counter::default();
    let counted = scored.clone();
    let handler = move |request: EvaluateRequest, arrival: Arrival| {
        let budget_ms = request.budget_ms;
        let scores = answer(metric, &instance, &answering, request, &|| arrival.is_over(budget_ms))?;
        counted.inc_by(scores.cost.len() as u64);
        let elapsed_us = arrival.elapsed().as_micros() as u64;
        Ok(Scores { elapsed_us, slots: u32::try_from(slots).ok(), ..scores })
    };
    let server = serve(session, &key, config.slots, config.queue, handler)?;
    let mut metrics = Metrics::of_pool(metric, config);
    metrics.count("candidates", "Candidates costed", scored);
    let warmed = move || fields.warmed();
    let announced = announce_service(config, &[("data", session)], metrics, server.counts(), warmed)?;
    on_ready(announced.metrics_address());
    tracing::info!(metric, instance = %config.instance, "evaluator ready");
    shutdown.requested().await;
    drop(announced);
    Ok(())
}

/// The scores of `instance`. A request without candidates derives what such requests need; one with
/// candidates for which it has not been derived is refused as cold, at once.
pub fn answer(
    metric: &str,
    instance: &str,
    fields: &Fields,
    request: EvaluateRequest,
    should_stop: &dyn Fn() -> bool,
) -> Result<Scores, Reject> {
    let started = Instant::now();
    let warms_up = request.candidates.count == 0;
    if !warms_up && should_stop() {
        return Err(Reject::new(RejectCode::Stopped, "its time was over before a slot was free"));
    }
    let evaluator = if warms_up {
        evaluator(metric, &request, fields)
    } else {
        evaluator(metric, &request, &fields.kept())
    }?;
    let (epoch, seq, shard) = (request.epoch, request.seq, request.shard);
    let scene = convert::scene(&request.scene)?;
    let candidates = convert::candidates(request.candidates)?;
    let cost = evaluator
        .evaluate(&scene, &candidates, should_stop)
        .map_err(|e| Reject::new(RejectCode::Stopped, e.to_string()))?;
    Ok(Scores {
        epoch,
        seq,
        shard,
        metric: metric.to_owned(),
        instance: instance.to_owned(),
        cost: cost.into(),
        elapsed_us: started.elapsed().as_micros() as u64,
        slots: None,
    })
}
