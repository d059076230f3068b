//! Typed questions with a deadline.

use std::time::Duration;

use curionav_schemas::{Clock, Message, Reject};
use zenoh::handlers::{FifoChannel, FifoChannelHandler};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{ConsolidationMode, QueryTarget, Reply};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

/// Why a question has no answer.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum AskError {
    /// Nothing serves the key, or what did has ended: the query ended without a reply.
    #[error("no answer")]
    NoReply,
    /// Not in time.
    #[error("no answer in time")]
    Timeout,
    /// Refused, with the reason.
    #[error("refused: {0}")]
    Rejected(Reject),
    /// The answer could not be understood.
    #[error("unusable answer: {0}")]
    Malformed(String),
    /// The question could not be sent.
    #[error("cannot ask: {0}")]
    Send(String),
}

/// The error reply that sessions and routers of Zenoh give by themselves, under one encoding or another.
const ZENOH_TIMEOUT: &[u8] = b"Timeout";

/// Replies to one question that wait to be read.
const KEPT: usize = 4;

/// How a question travels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Urgency {
    /// Work of a cycle. In real time it is dropped rather than stalling the link, and asked again elsewhere;
    /// in lockstep it waits for room, as everything does.
    Shard {
        /// How the robot's time passes.
        clock: Clock,
    },
    /// Everything else: missions, maps, scenarios.
    Normal,
}

/// Asks `key` and waits for the first usable answer, at most `timeout`.
pub async fn ask<Q: Message, A: Message>(
    session: &Session,
    key: &str,
    question: &Q,
    timeout: Duration,
    urgency: Urgency,
) -> Result<A, AskError> {
    ask_encoded::<Q, A>(session, key, question.encode(), timeout, urgency).await
}

/// As [`ask`], with the question `Q` in its bytes.
pub async fn ask_encoded<Q: Message, A: Message>(
    session: &Session,
    key: &str,
    question: Vec<u8>,
    timeout: Duration,
    urgency: Urgency,
) -> Result<A, AskError> {
    let question = Some((question, Q::ENCODING));
    send(session, key, question, timeout, urgency, QueryTarget::BestMatching, KEPT)?.first(Ok).await
}

/// Asks `key` without a question in words: the current state, or a map.
pub async fn fetch<A: Message>(session: &Session, key: &str, timeout: Duration) -> Result<A, AskError> {
    send(session, key, None, timeout, Urgency::Normal, QueryTarget::BestMatching, KEPT)?.first(Ok).await
}

/// Asks every queryable of `key` and takes the first answer that `accept` makes something of: whatever else
/// is served under the name of something known by its content is passed over.
pub(crate) async fn fetch_from_all<A: Message, T>(
    session: &Session,
    key: &str,
    timeout: Duration,
    accept: impl Fn(A) -> Result<T, Reject>,
) -> Result<T, AskError> {
    send(session, key, None, timeout, Urgency::Normal, QueryTarget::All, KEPT)?.first(accept).await
}

/// A question on its way, by its encoding; at most `kept` replies wait to be read.
pub(crate) fn send(
    session: &Session,
    key: &str,
    question: Option<(Vec<u8>, &'static str)>,
    timeout: Duration,
    urgency: Urgency,
    target: QueryTarget,
    kept: usize,
) -> Result<Replies, AskError> {
    let (congestion, priority) = match urgency {
        Urgency::Shard { clock: Clock::Realtime } => (CongestionControl::Drop, Priority::InteractiveLow),
        Urgency::Shard { clock: Clock::Lockstep } => (CongestionControl::Block, Priority::InteractiveLow),
        Urgency::Normal => (CongestionControl::Block, Priority::Data),
    };
    let mut get = session
        .get(key.to_owned())
        .target(target)
        .consolidation(ConsolidationMode::None)
        .timeout(timeout)
        .congestion_control(congestion)
        .priority(priority)
        .express(true);
    if let Some((payload, encoding)) = question {
        get = get.payload(payload).encoding(encoding);
    }
    let open = get.with(FifoChannel::new(kept)).wait().map_err(|e| AskError::Send(e.to_string()))?;
    // Zenoh's own timer can be late on a starved machine; ours bounds the wait in any case.
    let deadline = tokio::time::Instant::now() + timeout + Duration::from_millis(20);
    Ok(Replies { open: Some(open), deadline })
}

/// The replies to one question, as they come.
pub(crate) struct Replies {
    /// Until the deadline has passed.
    open: Option<FifoChannelHandler<Reply>>,
    deadline: tokio::time::Instant,
}

impl Replies {
    /// The next reply; nothing after the last, and after the one that says that the time is over.
    pub(crate) async fn next(&mut self) -> Option<Result<Sample, AskError>> {
        let next = self.open.as_ref()?.recv_async();
        let Ok(reply) = tokio::time::timeout_at(self.deadline, next).await else {
            self.open = None;
            return Some(Err(AskError::Timeout));
        };
        Some(reply.ok()?.into_result().map_err(|error| {
            let (encoding, payload) = (error.encoding().to_string(), error.payload().to_bytes());
            match Reject::decode(&payload, Some(&encoding)) {
                Ok(reject) => AskError::Rejected(reject),
                Err(_) if *payload == *ZENOH_TIMEOUT => AskError::Timeout,
                Err(error) => AskError::Malformed(error.to_string()),
            }
        }))
    }

    /// The first that `accept` makes something of.
    async fn first<A: Message, T>(mut self, accept: impl Fn(A) -> Result<T, Reject>) -> Result<T, AskError> {
        let mut failure = AskError::NoReply;
        while let Some(reply) = self.next().await {
            let usable = reply.and_then(|sample| {
                let encoding = sample.encoding().to_string();
                let answer = A::decode(&sample.payload().to_bytes(), Some(&encoding));
                answer.and_then(&accept).map_err(|reject| AskError::Malformed(reject.to_string()))
            });
            match usable {
                Ok(answer) => return Ok(answer),
                Err(error) => failure = error,
            }
        }
        Err(failure)
    }
}
