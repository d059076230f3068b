//! One service of a pool: what the trajectory generators and the evaluators have in common.

use std::hash::{DefaultHasher, Hash, Hasher};
use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_runtime::metrics::{Counter, Metrics};
use curionav_runtime::process::Start;
use curionav_runtime::serve::{Asked, refusals, serve_in_time};
use curionav_runtime::status::announce_service;
use curionav_schemas::{Message, Refusal, Reject, keys};

use crate::preparation::Preparations;
use curionav_runtime::fields::Fields;

/// Bytes of a question that warms a replica up and may wait until that is done: a hundred times those of a question
/// with a built-in profile and no people.
const WARM_UP_BYTES: usize = 256 << 10;

/// Serves `role`. `answer` is told who asks and when the question came, and also gives how many candidates are in the
/// answer: they are counted, which `help` describes. A question without a `budget` warms the replica up: it is answered
/// once all that such questions need is there, and refused as cold while that is derived beside the work.
pub(crate) async fn run<Q: Message + Clone + Send + 'static, A: Message>(
    role: &str,
    help: &str,
    start: Start<'_>,
    // Nothing for a question that warms the replica up.
    budget: fn(&Q) -> Option<Duration>,
    answer: impl Fn(&Fields, Q, Asked<'_>) -> Result<(usize, A), Reject> + Send + Sync + 'static,
) -> anyhow::Result<()> {
    let Start { config, session, fields, mut shutdown, on_ready } = start;
    let candidates: Counter = Counter::default();
    let answering = fields.clone();
    let counted = candidates.clone();
    let answer = Arc::new(answer);
    let preparations = Preparations::start()?;
    let handle = move |question: Q, asked: Asked<'_>| {
        let (count, answer) = if budget(&question).is_none() {
            answer(&answering.kept(), question.clone(), asked).map_err(|reject| {
                if !matches!(reject.why, Refusal::Cold { .. }) {
                    return reject;
                }
                let answer = Arc::clone(&answer);
                let fields = answering.clone();
                let key = match fingerprint(&question) {
                    Ok(key) => key,
                    Err(oversize) => return oversize,
                };
                let robot = asked.name.to_owned();
                preparations.refuse(key, reject, move || {
                    match answer(&fields, question, Asked { name: &robot, came: Instant::now() }) {
                        // Its budget is over, and what it needs is there.
                        Ok(_) | Err(Reject { why: Refusal::Stopped, .. }) => Ok(()),
                        Err(reject) => Err(reject),
                    }
                })
            })?
        } else {
            answer(&answering.kept(), question, asked)?
        };
        counted.inc_by(count as u64);
        Ok(answer)
    };
    let handler = move |question: Q, asked: Asked<'_>| (budget(&question), handle(question, asked));
    let key = keys::questions(role, &config.instance)?;
    let server = serve_in_time(session, &key, (config.slots, config.queue), &refusals(), handler)?;
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

/// The same for two questions that prepare for the same. One that is too large to wait is refused.
fn fingerprint<Q: Message>(question: &Q) -> Result<u64, Reject> {
    let bytes = question.encode();
    if bytes.len() > WARM_UP_BYTES {
        return Err(Refusal::Oversize { found: bytes.len() as u64, most: WARM_UP_BYTES as u64 }.into());
    }
    let mut hasher = DefaultHasher::new();
    bytes.hash(&mut hasher);
    Ok(hasher.finish())
}
