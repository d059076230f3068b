//! A bare Zenoh query: what asking costs when there is nothing to encode and nothing to compute.

use std::time::{Duration, Instant};

use curionav_schemas::{Clock, keys};
use zenoh::query::{Query, QueryTarget, Queryable};
use zenoh::{Session, Wait};

use crate::process::{Running, Start};
use crate::query::{AskError, Kept, Urgency, send};
use crate::serve::ServeError;

/// Largest answer that is given, bytes: no message of the contract is larger than 64 MiB.
const ANSWER_MAX: u64 = 64 << 20;

/// Answers every question with as many bytes as it asks for, for as long as it lives.
pub fn serve(session: &Session, instance: &str) -> Result<Queryable<()>, ServeError> {
    let key = keys::echo(instance);
    let queryable = session.declare_queryable(key.clone()).callback(|query| answer(&query)).wait();
    queryable.map_err(|e| ServeError::new(&key, e))
}

/// The same as a service, until `shutdown`.
pub fn run(start: Start<'_>) -> Running<'_> {
    Box::pin(async move {
        let Start { config, session, mut shutdown, on_ready, .. } = start;
        let _serving = serve(session, &config.instance)?;
        on_ready(None);
        shutdown.requested().await;
        Ok(())
    })
}

/// The first eight bytes of a question say how long its answer shall be.
fn answer(query: &Query) {
    let question = query.payload().map(|p| p.to_bytes()).unwrap_or_default();
    let wanted = question.first_chunk().map_or(0, |bytes| u64::from_le_bytes(*bytes));
    let answer = vec![0_u8; wanted.min(ANSWER_MAX) as usize];
    if let Err(error) = query.reply(query.key_expr().clone(), answer).wait() {
        tracing::debug!(%error, "echo not sent");
    }
}

/// How long a bare query takes, with a question and an answer of so many bytes (a question has at least
/// eight), travelling as a shard does in lockstep.
pub async fn round_trip(
    session: &Session,
    instance: &str,
    (question, answer): (usize, usize),
    timeout: Duration,
) -> Result<Duration, AskError> {
    let mut payload = vec![0_u8; question.max(8)];
    payload[..8].copy_from_slice(&(answer as u64).to_le_bytes());
    let started = Instant::now();
    let key = keys::echo(instance);
    let urgency = Urgency::Shard { clock: Clock::Lockstep };
    let question = Some((payload, "zenoh/bytes"));
    let kept = Kept { replies: 4, most: ANSWER_MAX as usize };
    let mut replies = send(session, &key, question, timeout, urgency, QueryTarget::BestMatching, kept)?;
    let reply = replies.next().await.unwrap_or(Err(AskError::NoReply))?;
    let took = started.elapsed();
    match reply.bytes.len() {
        length if length == answer => Ok(took),
        length => Err(AskError::Malformed(format!("{length} bytes of {answer}"))),
    }
}
