//! One evaluator as a service: what all evaluators have in common.

use std::time::{Duration, Instant};

use curionav_schemas::{EvaluateRequest, Refusal, Reject, Scores, keys};
use zenoh::Session;

use crate::evaluators::evaluator;
use crate::fields::Fields;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::metrics::{Counter, Metrics};
use curionav_runtime::process::OnReady;
use curionav_runtime::serve::serve;
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::status::announce_service;

/// Serves `term` until `shutdown`. A request without candidates warms the replica: it is answered
/// once every field the request would need is there. `on_ready` is called when requests are answered.
pub async fn run(
    term: &'static str,
    config: &ServiceConfig,
    session: &Session,
    mut shutdown: Shutdown,
    on_ready: OnReady,
) -> anyhow::Result<()> {
    let fields = Fields::new(session);
    let (instance, slots) = (config.instance.clone(), config.slots as u32);
    let key = keys::questions(term, &instance)?;
    let answering = fields.clone();
    let scored: Counter = Counter::default();
    let counted = scored.clone();
    let handler = move |request: EvaluateRequest, came: Instant| {
        let budget = Duration::from_millis(request.budget_ms.into());
        let scores = answer(term, &instance, &answering, request, &|| came.elapsed() > budget)?;
        counted.inc_by(scores.cost.len() as u64);
        let elapsed_us = came.elapsed().as_micros() as u64;
        Ok(Scores { elapsed_us, slots, ..scores })
    };
    let server = serve(session, &key, config.slots, config.queue, handler)?;
    let mut metrics = Metrics::of_pool(term, config);
    metrics.count("candidates", "Candidates scored", scored);
    let prepared = move || fields.prepared();
    let announced = announce_service(config, &[("data", session)], metrics, server.counts(), prepared)?;
    on_ready(announced.metrics_address());
    tracing::info!(term, instance = %config.instance, "evaluator ready");
    shutdown.requested().await;
    drop(announced);
    Ok(())
}

/// The scores of `instance`. A request without candidates derives what such requests need; one with
/// candidates for which it has not been derived is refused as cold, at once.
pub fn answer(
    term: &str,
    instance: &str,
    fields: &Fields,
    request: EvaluateRequest,
    should_stop: &dyn Fn() -> bool,
) -> Result<Scores, Reject> {
    let started = Instant::now();
    let warms_up = request.candidates.count == 0;
    if !warms_up && should_stop() {
        return Err(Refusal::Stopped.into());
    }
    let evaluator =
        if warms_up { evaluator(term, &request, fields) } else { evaluator(term, &request, &fields.kept()) }?;
    let (epoch, seq, shard) = (request.epoch, request.seq, request.shard);
    let scene = convert::scene(&request.scene)?;
    let candidates = convert::candidates(request.candidates)?;
    let cost = evaluator.evaluate(&scene, &candidates, should_stop).map_err(|_| Refusal::Stopped)?;
    Ok(Scores {
        epoch,
        seq,
        shard,
        term: term.to_owned(),
        instance: instance.to_owned(),
        cost: cost.into(),
        elapsed_us: started.elapsed().as_micros() as u64,
        slots: 1,
    })
}

/// Declares `run`, which serves one term.
#[macro_export]
macro_rules! evaluation_service {
    ($term:literal) => {
        /// Serves until `shutdown`; `on_ready` is called once requests are answered.
        pub fn run<'a>(
            config: &'a curionav_runtime::config::ServiceConfig,
            session: &'a zenoh::Session,
            shutdown: curionav_runtime::shutdown::Shutdown,
            on_ready: curionav_runtime::process::OnReady,
        ) -> curionav_runtime::process::Running<'a> {
            Box::pin($crate::evaluation_service::run($term, config, session, shutdown, on_ready))
        }
    };
}
