//! Typed questions with a deadline.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::Duration;

use curionav_schemas::{Clock, Message, Refusal, Reject};
use tokio::sync::mpsc;
use zenoh::qos::{CongestionControl, Priority};
use zenoh::query::{ConsolidationMode, QueryTarget, Reply};
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
/// Bytes that these may have together, but for room for one of the largest.
const KEPT_BYTES: usize = 4 << 20;
/// The share of the time for a map that one holder has alone.
const FIRST_HOLDER: f64 = 0.25;

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

impl Urgency {
    /// What Zenoh calls it.
    pub fn quality(self) -> (CongestionControl, Priority) {
        match self {
            Self::Shard { clock: Clock::Realtime } => (CongestionControl::Drop, Priority::InteractiveLow),
            Self::Shard { clock: Clock::Lockstep } => (CongestionControl::Block, Priority::InteractiveLow),
            Self::Normal => (CongestionControl::Block, Priority::Data),
        }
    }
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
    ask_counted::<Q, A>(session, key, question, timeout, urgency).await.0
}

/// As [`ask_encoded`]; also gives the bytes of the replies that came.
pub async fn ask_counted<Q: Message, A: Message>(
    session: &Session,
    key: &str,
    question: Vec<u8>,
    timeout: Duration,
    urgency: Urgency,
) -> (Result<A, AskError>, u64) {
    let question = Some((question, Q::ENCODING));
    let kept = Kept { replies: KEPT, most: A::MAX_BYTES };
    match send(session, key, question, timeout, urgency, QueryTarget::BestMatching, kept) {
        Ok(mut replies) => (replies.first(Ok).await, replies.received),
        Err(error) => (Err(error), 0),
    }
}

/// Asks `key` without a question in words: the current state, or a map.
pub async fn fetch<A: Message>(session: &Session, key: &str, timeout: Duration) -> Result<A, AskError> {
    fetch_from(session, key, timeout, QueryTarget::BestMatching, Ok).await
}

/// Asks one queryable of `key`, and all of them if that has nothing that `accept` makes something of: what else is
/// served under the name of something known by its content is passed over. So several holders of a map need not all
/// send it.
pub(crate) async fn fetch_known<A: Message, T>(
    session: &Session,
    key: &str,
    timeout: Duration,
    accept: impl Fn(A) -> Result<T, Reject>,
) -> Result<T, AskError> {
    let of_one = timeout.mul_f64(FIRST_HOLDER);
    let asked = tokio::time::Instant::now();
    match fetch_from(session, key, of_one, QueryTarget::BestMatching, &accept).await {
        Ok(found) => Ok(found),
        Err(error) => {
            tracing::debug!(key, %error, "asking every holder");
            let left = timeout.saturating_sub(asked.elapsed());
            fetch_from(session, key, left, QueryTarget::All, &accept).await
        }
    }
}

async fn fetch_from<A: Message, T>(
    session: &Session,
    key: &str,
    timeout: Duration,
    target: QueryTarget,
    accept: impl Fn(A) -> Result<T, Reject>,
) -> Result<T, AskError> {
    let kept = Kept { replies: KEPT, most: A::MAX_BYTES };
    send(session, key, None, timeout, Urgency::Normal, target, kept)?.first(accept).await
}

/// What is kept of the replies to a question until it is read; further replies are dropped.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Kept {
    /// Replies that wait.
    pub(crate) replies: usize,
    /// Bytes of the longest reply; a longer one is refused before it is copied.
    pub(crate) most: usize,
}

/// A question on its way, by its encoding.
pub(crate) fn send(
    session: &Session,
    key: &str,
    question: Option<(Vec<u8>, &'static str)>,
    timeout: Duration,
    urgency: Urgency,
    target: QueryTarget,
    kept: Kept,
) -> Result<Replies, AskError> {
    let (congestion, priority) = urgency.quality();
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
    let (sender, open) = mpsc::channel(kept.replies);
    let waiting = Arc::new(AtomicUsize::new(0));
    let counted = Arc::clone(&waiting);
    let most = KEPT_BYTES.max(kept.most);
    get.callback(move |reply| {
        let reply = Answer::of(reply, kept.most);
        let bytes = reply.as_ref().map_or(0, |answer| answer.bytes.len());
        if counted.fetch_add(bytes, Ordering::Relaxed) + bytes > most || sender.try_send(reply).is_err() {
            counted.fetch_sub(bytes, Ordering::Relaxed);
        }
    })
    .wait()
    .map_err(|e| AskError::Send(e.to_string()))?;
    // Zenoh's own timer can be late on a starved machine; ours bounds the wait in any case.
    let deadline = tokio::time::Instant::now() + timeout + Duration::from_millis(20);
    Ok(Replies { open: Some(open), waiting, received: 0, deadline })
}

/// One reply as it came.
#[derive(Debug)]
pub(crate) struct Answer {
    pub(crate) key: String,
    pub(crate) bytes: Vec<u8>,
    pub(crate) encoding: String,
}

impl Answer {
    /// A reply of at most so many bytes.
    fn of(reply: Reply, most: usize) -> Result<Self, AskError> {
        let too_long = |found: usize, most: usize| {
            let oversize = Refusal::Oversize { found: found as u64, most: most as u64 };
            AskError::Malformed(Reject::from(oversize).to_string())
        };
        match reply.into_result() {
            Ok(sample) if sample.payload().len() > most => Err(too_long(sample.payload().len(), most)),
            Ok(sample) => Ok(Self {
                key: sample.key_expr().to_string(),
                bytes: sample.payload().to_bytes().into_owned(),
                encoding: sample.encoding().to_string(),
            }),
            Err(error) if error.payload().len() > Reject::MAX_BYTES => {
                Err(too_long(error.payload().len(), Reject::MAX_BYTES))
            }
            Err(error) => {
                let encoding = error.encoding().to_string();
                let payload = error.payload().to_bytes();
                Err(match Reject::decode(&payload, Some(&encoding)) {
                    Ok(reject) => AskError::Rejected(reject),
                    Err(_) if *payload == *ZENOH_TIMEOUT => AskError::Timeout,
                    Err(error) => AskError::Malformed(error.to_string()),
                })
            }
        }
    }
}

/// The replies to one question, as they come.
pub(crate) struct Replies {
    /// Until the deadline has passed.
    open: Option<mpsc::Receiver<Result<Answer, AskError>>>,
    /// Bytes that wait.
    waiting: Arc<AtomicUsize>,
    /// Bytes of the replies that were taken.
    received: u64,
    deadline: tokio::time::Instant,
}

impl Replies {
    /// The next reply; nothing after the last, and after the one that says that the time is over.
    pub(crate) async fn next(&mut self) -> Option<Result<Answer, AskError>> {
        let next = self.open.as_mut()?.recv();
        let Ok(reply) = tokio::time::timeout_at(self.deadline, next).await else {
            self.open = None;
            return Some(Err(AskError::Timeout));
        };
        let reply = reply?;
        let bytes = reply.as_ref().map_or(0, |answer| answer.bytes.len());
        self.received += bytes as u64;
        self.waiting.fetch_sub(bytes, Ordering::Relaxed);
        Some(reply)
    }

    /// The next reply, read; as [`Self::next`].
    pub(crate) async fn next_read<A: Message, T>(
        &mut self,
        accept: impl Fn(A) -> Result<T, Reject>,
    ) -> Option<Result<T, AskError>> {
        let reply = self.next().await?;
        Some(reply.and_then(|answer| {
            let read = A::decode(&answer.bytes, Some(&answer.encoding));
            read.and_then(&accept).map_err(|reject| AskError::Malformed(reject.to_string()))
        }))
    }

    /// The first that `accept` makes something of.
    async fn first<A: Message, T>(&mut self, accept: impl Fn(A) -> Result<T, Reject>) -> Result<T, AskError> {
        let mut failure = AskError::NoReply;
        while let Some(usable) = self.next_read(&accept).await {
            match usable {
                Ok(answer) => return Ok(answer),
                Err(error) => failure = error,
            }
        }
        Err(failure)
    }
}
