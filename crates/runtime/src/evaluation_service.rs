//! One evaluator as a service: what the CPC and the HCCDM evaluator have in common.

use std::sync::Arc;
use std::time::Instant;

use curionav_schemas::{EvaluateRequest, Reject, RejectCode, Scores, keys};
use zenoh::Session;

use crate::config::ServiceConfig;
use crate::convert;
use crate::evaluators::evaluator;
use crate::fields::Fields;
use crate::membership::announce;
use crate::serve::{Arrival, serve};
use crate::shutdown::Shutdown;
use crate::status::serve_status;

/// Serves `metric` until `shutdown`. A request without candidates warms the replica: it is answered
/// once every field the request would need is there. `on_ready` is called when requests are answered.
pub async fn run(
    metric: &'static str,
    config: &ServiceConfig,
    session: &Session,
    mut shutdown: Shutdown,
    on_ready: impl FnOnce(),
) -> anyhow::Result<()> {
    let fields = Arc::new(Fields::new(session));
    let instance = config.instance.clone();
    let key = keys::evaluate(metric, &instance)?;
    let handler = move |request: EvaluateRequest, arrival: Arrival| {
        answer(metric, &instance, &fields, request, arrival)
    };
    let server = serve(session, &key, config.slots, config.queue, handler)?;
    let _status = serve_status(session, metric, &config.instance, server.counts())?;
    let token = announce(session, metric, &config.instance)?;
    on_ready();
    tracing::info!(metric, instance = %config.instance, "evaluator ready");
    shutdown.requested().await;
    drop(token);
    Ok(())
}

fn answer(
    metric: &str,
    instance: &str,
    fields: &Fields,
    request: EvaluateRequest,
    arrival: Arrival,
) -> Result<Scores, Reject> {
    let started = Instant::now();
    let evaluator = evaluator(metric, &request, fields)?;
    let (budget_ms, epoch, seq, shard) = (request.budget_ms, request.epoch, request.seq, request.shard);
    let scene = convert::scene(&request.scene)?;
    let candidates = convert::candidates(request.candidates)?;
    let cost = evaluator
        .evaluate(&scene, &candidates, &|| arrival.is_over(budget_ms))
        .map_err(|e| Reject::new(RejectCode::Stopped, e.to_string()))?;
    Ok(Scores {
        epoch,
        seq,
        shard,
        metric: metric.to_owned(),
        instance: instance.to_owned(),
        cost: cost.into(),
        elapsed_us: started.elapsed().as_micros() as u64,
    })
}
