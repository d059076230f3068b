//! One replica as a service: what generators and evaluators have in common.

use std::time::{Duration, Instant};

use curionav_runtime::config::ServiceConfig;
use curionav_runtime::metrics::{Counter, Metrics};
use curionav_runtime::process::OnReady;
use curionav_runtime::serve::serve;
use curionav_runtime::shutdown::Shutdown;
use curionav_runtime::status::announce_service;
use curionav_schemas::{Message, Reject, keys};
use zenoh::Session;

use crate::fields::Fields;

/// Serves `role` until `shutdown`. `answer` gets the fields that the replica keeps, a question and when it came, and
/// gives the answer and how many candidates it is about, which are counted as `help` says. `on_ready` is called when
/// questions are answered.
pub(crate) async fn run<Q: Message, A: Message>(
    role: &'static str,
    config: &ServiceConfig,
    session: &Session,
    mut shutdown: Shutdown,
    on_ready: OnReady,
    help: &str,
    answer: impl Fn(&Fields, Q, Instant) -> Result<(A, usize), Reject> + Send + Sync + 'static,
) -> anyhow::Result<()> {
    let (fields, candidates) = (Fields::new(session), <Counter>::default());
    let (kept, counted) = (fields.clone(), candidates.clone());
    let handler = move |question: Q, came: Instant| {
        let (answer, count) = answer(&kept, question, came)?;
        counted.inc_by(count as u64);
        Ok(answer)
    };
    let key = keys::questions(role, &config.instance)?;
    let server = serve(session, &key, config.slots, config.queue, handler)?;
    let mut metrics = Metrics::of_pool(role, config);
    metrics.count("candidates", help, candidates);
    let prepared = move || fields.prepared();
    let announced = announce_service(config, &[("data", session)], metrics, server.counts(), prepared)?;
    on_ready(announced.metrics_address());
    tracing::info!(role, instance = %config.instance, "replica ready");
    shutdown.requested().await;
    drop(announced);
    Ok(())
}

/// Whether the `budget_ms` of a question that `came` then is spent.
pub(crate) fn is_over(came: Instant, budget_ms: u32) -> bool {
    came.elapsed() > Duration::from_millis(u64::from(budget_ms))
}
