//! One evaluator as a service: what all evaluators have in common.

use std::time::Instant;

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::convert;
use curionav_runtime::process::OnReady;
use curionav_runtime::shutdown::Shutdown;
use curionav_schemas::{EvaluateRequest, Refusal, Reject, Scores};
use zenoh::Session;

use crate::evaluators::evaluator;
use crate::fields::Fields;
use crate::replica_service::{self, is_over};

/// Serves `term` until `shutdown`. A request without candidates warms the replica: it is answered
/// once every field the request would need is there. `on_ready` is called when requests are answered.
pub async fn run(
    term: &'static str,
    config: &ServiceConfig,
    session: &Session,
    shutdown: Shutdown,
    on_ready: OnReady,
) -> anyhow::Result<()> {
    let (instance, slots) = (config.instance.clone(), config.slots as u32);
    let help = "Candidates scored";
    replica_service::run(term, config, session, shutdown, on_ready, help, move |fields, request, came| {
        let request: EvaluateRequest = request;
        let budget_ms = request.budget_ms;
        let scores = answer(term, &instance, fields, request, &|| is_over(came, budget_ms))?;
        let (count, elapsed_us) = (scores.cost.len(), came.elapsed().as_micros() as u64);
        Ok((Scores { elapsed_us, slots, ..scores }, count))
    })
    .await
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
