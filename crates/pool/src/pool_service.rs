//! One service of a pool: what the trajectory generators and the evaluators have in common.

use std::time::Instant;

use curionav_runtime::metrics::{Counter, Metrics};
use curionav_runtime::process::Start;
use curionav_runtime::serve::{refusals, serve};
use curionav_runtime::status::announce_service;
use curionav_schemas::{Message, Reject, keys};

use curionav_runtime::fields::Fields;

/// Serves `role`. `answer` is told when the question came, and also gives how many candidates are in the answer: they
/// are counted, which `help` describes.
pub(crate) async fn run<Q: Message, A: Message>(
    role: &str,
    help: &str,
    start: Start<'_>,
    answer: impl Fn(&Fields, Q, Instant) -> Result<(usize, A), Reject> + Send + Sync + 'static,
) -> anyhow::Result<()> {
    let Start { config, session, fields, mut shutdown, on_ready } = start;
    let candidates: Counter = Counter::default();
    let (answering, counted) = (fields.clone(), candidates.clone());
    let handler = move |question: Q, came: Instant| {
        let (count, answer) = answer(&answering, question, came)?;
        counted.inc_by(count as u64);
        Ok(answer)
    };
    let key = keys::questions(role, &config.instance)?;
    let server = serve(session, &key, (config.slots, config.queue), &refusals(), handler)?;
    let mut metrics = Metrics::new(role, &config.instance, None);
    metrics.count("candidates", help, candidates);
    let fields = fields.clone();
    let prepared = move || fields.prepared();
    let announced = announce_service(config, &[("data", session)], metrics, server.counts(), prepared)?;
    on_ready(announced.metrics_address());
    tracing::info!(role, instance = %config.instance, "ready");
    shutdown.requested().await;
    Ok(())
}
