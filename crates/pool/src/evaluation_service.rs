//! One evaluator as a service.

use std::time::{Duration, Instant};

use curionav_runtime::convert;
use curionav_runtime::process::{Running, Start};
use curionav_schemas::{EvaluateRequest, Refusal, Reject, Scores};

use crate::evaluators::evaluator;
use crate::pool_service;
use curionav_runtime::fields::Fields;

/// Serves `term`. A request without candidates warms the replica: it is answered once every field the request would
/// need is there.
pub fn run<'a>(term: &'static str, start: Start<'a>) -> Running<'a> {
    let (instance, slots) = (start.config.instance.clone(), start.config.slots as u32);
    let answer = move |fields: &Fields, request: EvaluateRequest, came: Instant| {
        let scores = answer(term, &instance, fields, request, slots, &|| came.elapsed())?;
        Ok((scores.cost.len(), scores))
    };
    Box::pin(pool_service::run(term, "Candidates scored", start, answer))
}

/// The scores of `instance`, which has so many `slots`, within the budget of `request`, of which some has `elapsed`. A
/// request without candidates derives what such requests need; one with candidates for which it has not been derived is
/// refused as cold, at once.
pub fn answer(
    term: &str,
    instance: &str,
    fields: &Fields,
    request: EvaluateRequest,
    slots: u32,
    elapsed: &dyn Fn() -> Duration,
) -> Result<Scores, Reject> {
    let budget = Duration::from_millis(request.budget_ms.into());
    let should_stop = || elapsed() > budget;
    let warms_up = request.candidates.count == 0;
    if !warms_up && should_stop() {
        return Err(Refusal::Stopped.into());
    }
    let evaluator =
        if warms_up { evaluator(term, &request, fields) } else { evaluator(term, &request, &fields.kept()) }?;
    let (epoch, seq, shard) = (request.epoch, request.seq, request.shard);
    let scene = convert::scene(&request.scene);
    let candidates = convert::candidates(request.candidates)?;
    let cost = evaluator.evaluate(&scene, &candidates, &should_stop).map_err(|_| Refusal::Stopped)?;
    Ok(Scores {
        epoch,
        seq,
        shard,
        term: term.to_owned(),
        instance: instance.to_owned(),
        cost: cost.into(),
        elapsed_us: elapsed().as_micros() as u64,
        slots,
    })
}
