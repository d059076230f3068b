//! Looking at a deployment from outside: replies as they come, with their size and time, and streams overheard.

use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use curionav_schemas::{Message, Reject};
use zenoh::pubsub::Subscriber;
use zenoh::query::QueryTarget;
use zenoh::{Session, Wait};

use crate::locked::locked;
use crate::query::{AskError, Kept, Urgency, send};
use crate::topic::TopicError;

/// Replies to one question that are kept: more instances of a role than a deployment has.
const REPLIES_MAX: usize = 256;
/// Bytes of one: more than any message has.
const REPLY_BYTES_MAX: usize = 64 << 20;

/// One reply as it came.
#[derive(Debug, Clone)]
pub struct RawReply {
    /// Its key.
    pub key: String,
    /// Payload and encoding, or the refusal.
    pub answer: Result<(Vec<u8>, String), Reject>,
}

impl RawReply {
    /// Bytes of an answer.
    pub fn bytes(&self) -> usize {
        self.answer.as_ref().map_or(0, |(payload, _)| payload.len())
    }

    /// The answer, if it is one and can be understood.
    pub fn decode<A: Message>(&self) -> Option<Result<A, Reject>> {
        let (payload, encoding) = self.answer.as_ref().ok()?;
        Some(A::decode(payload, Some(encoding)))
    }
}

/// Asks every queryable under `key`, which may have wildcards, and waits for all replies, at most `timeout`. Also
/// gives the time until the last one.
pub async fn ask_all(
    session: &Session,
    key: &str,
    question: Option<(Vec<u8>, &'static str)>,
    timeout: Duration,
) -> Result<(Vec<RawReply>, Duration), AskError> {
    let started = Instant::now();
    let kept = Kept { replies: REPLIES_MAX, most: REPLY_BYTES_MAX };
    let mut replies = send(session, key, question, timeout, Urgency::Normal, QueryTarget::All, kept)?;
    let mut came = Vec::new();
    let mut last = Duration::ZERO;
    while let Some(reply) = replies.next().await {
        let reply = match reply {
            Ok(answer) => RawReply { key: answer.key, answer: Ok((answer.bytes, answer.encoding)) },
            Err(AskError::Rejected(reject)) => RawReply { key: String::new(), answer: Err(reject) },
            // A router's own word for a timeout is no answer.
            Err(_) => continue,
        };
        if came.len() < REPLIES_MAX {
            last = started.elapsed();
            came.push(reply);
        }
    }
    Ok((came, last))
}

/// What has been overheard on one key.
#[derive(Debug, Clone, Default)]
pub struct Heard {
    /// Messages.
    pub messages: u64,
    /// Their bytes.
    pub bytes: u64,
    /// Those that could not be understood.
    pub malformed: u64,
    /// When the first and the last came.
    pub between: Option<(Instant, Instant)>,
}

impl Heard {
    /// Messages a second, from the second one on.
    pub fn rate_hz(&self) -> Option<f64> {
        let (first, last) = self.between?;
        let span = last.duration_since(first).as_secs_f64();
        (self.messages > 1 && span > 0.0).then(|| (self.messages - 1) as f64 / span)
    }
}

/// Overhears one stream for as long as it lives.
pub struct Listener {
    _subscriber: Subscriber<()>,
    heard: Arc<Mutex<Heard>>,
}

impl Listener {
    /// Overhears `key`, where messages of type `M` belong.
    pub fn new<M: Message>(session: &Session, key: &str) -> Result<Self, TopicError> {
        let heard = Arc::new(Mutex::new(Heard::default()));
        let counted = Arc::clone(&heard);
        let subscriber = session
            .declare_subscriber(key.to_owned())
            .callback(move |sample| {
                let payload = sample.payload();
                let encoding = sample.encoding().to_string();
                let admitted = M::admit(payload.len(), Some(&encoding));
                let malformed = admitted.and_then(|()| M::decode(&payload.to_bytes(), None)).is_err();
                let now = Instant::now();
                let mut heard = locked(&counted);
                heard.messages += 1;
                heard.bytes += payload.len() as u64;
                heard.malformed += u64::from(malformed);
                heard.between = Some((heard.between.map_or(now, |b| b.0), now));
            })
            .wait()
            .map_err(TopicError::on(key))?;
        Ok(Self { _subscriber: subscriber, heard })
    }

    /// What has come until now.
    pub fn heard(&self) -> Heard {
        locked(&self.heard).clone()
    }
}
