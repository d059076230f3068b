//! Typed publish/subscribe.

use std::marker::PhantomData;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};

use curionav_schemas::{Clock, Message, Reject};
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Locality;
use zenoh::{Session, Wait};

use crate::byte_ring::ByteRing;
use crate::locked::locked;
use crate::serve::ServeCounts;

/// Messages a subscriber may have waiting; beyond it the oldest goes. In lockstep the robot waits for what its
/// services need of each other, so that at most a few of these are in flight, but nothing waits for a reader of
/// reports. In real time only the newest matters.
const INBOX: usize = 256;
/// Bytes that these may have together, but for room for two of the largest: a hundred times what a robot's services
/// have waiting when they are slow.
const INBOX_BYTES: usize = 4 << 20;

/// How a stream travels (the QoS column of the key table in `schemas/README.md`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// Sensor data and beliefs: newest wins, dropped under pressure.
    Sensor,
    /// Decisions and commands: first in line, sent at once. They are dropped only once several wait for a link that
    /// does not move. Then they are out of date, and waiting would hold up those for others.
    Control,
    /// Missions, which are said again every second: as sensor data, behind them, and ahead of maps.
    Mission,
    /// States of a simulated run: not urgent, never dropped.
    State,
    /// Reports for people and recorders: last in line, dropped under pressure.
    Report,
    /// What is only looked at: as reports, but dropped under pressure in lockstep as well.
    Glimpse,
}

/// A typed publisher.
#[derive(Debug)]
pub struct Topic<M> {
    session: Session,
    key: KeyExpr<'static>,
    flow: Flow,
    message: PhantomData<fn(M)>,
}

/// The key or session was refused.
#[derive(Debug, thiserror::Error)]
#[error("{key}: {reason}")]
pub struct TopicError {
    key: String,
    reason: String,
}

impl TopicError {
    /// The error of a declaration on `key`.
    pub(crate) fn on(key: &str) -> impl Fn(zenoh::Error) -> Self {
        move |e| Self { key: key.into(), reason: e.to_string() }
    }
}

impl<M: Message> Topic<M> {
    /// A publisher on `key`.
    pub fn new(session: &Session, key: &str, flow: Flow) -> Result<Self, TopicError> {
        let declared = session.declare_keyexpr(key.to_owned()).wait().map_err(TopicError::on(key))?;
        Ok(Self { session: session.clone(), key: declared, flow, message: PhantomData })
    }

    /// Sends one message. In lockstep nothing that matters may be lost, so every flow but glimpses blocks. In real time
    /// what comes again is dropped rather than waited for: a router that waits for one reader, who may have stopped
    /// reading, takes nothing more from the sender meanwhile.
    pub fn publish(&self, message: &M, clock: Clock) {
        let realtime = clock == Clock::Realtime;
        let (priority, drops, express) = match self.flow {
            Flow::Sensor => (Priority::InteractiveHigh, realtime, true),
            Flow::Control => (Priority::RealTime, realtime, true),
            Flow::Mission => (Priority::DataHigh, realtime, false),
            Flow::State => (Priority::Data, false, false),
            Flow::Report => (Priority::DataLow, realtime, false),
            Flow::Glimpse => (Priority::DataLow, true, false),
        };
        let congestion = if drops { CongestionControl::Drop } else { CongestionControl::Block };
        let sent = self
            .session
            .put(&self.key, message.encode())
            .encoding(M::ENCODING)
            .priority(priority)
            .congestion_control(congestion)
            .express(express)
            .wait();
        if let Err(error) = sent {
            tracing::warn!(key = %self.key, %error, "not published");
        }
    }
}

/// A typed publisher of what is not worth making unless something listens.
pub struct OnDemand<M> {
    topic: Topic<M>,
    /// Knows the subscribers of this session. It cannot be asked about others: then Zenoh blocks, for which tokio gives
    /// the work of this thread to another one.
    here: Publisher<'static>,
    /// Is told by the network whether there are others.
    _elsewhere: Publisher<'static>,
    is_heard_elsewhere: Arc<AtomicBool>,
}

impl<M: Message> OnDemand<M> {
    /// A publisher on `key`.
    pub fn new(session: &Session, key: &str, flow: Flow) -> Result<Self, TopicError> {
        let topic = Topic::new(session, key, flow)?;
        let publisher = |destination| {
            let declared = session.declare_publisher(key.to_owned()).allowed_destination(destination);
            declared.wait().map_err(TopicError::on(key))
        };
        let here = publisher(Locality::SessionLocal)?;
        let elsewhere = publisher(Locality::Remote)?;
        let is_heard_elsewhere = Arc::new(AtomicBool::new(false));
        let told = Arc::clone(&is_heard_elsewhere);
        let listener = elsewhere
            .matching_listener()
            .callback(move |status| told.store(status.matching(), Ordering::Relaxed))
            .background();
        listener.wait().map_err(TopicError::on(key))?;
        Ok(Self { topic, here, _elsewhere: elsewhere, is_heard_elsewhere })
    }

    /// Whether something listens; no if that is not known.
    pub fn is_heard(&self) -> bool {
        self.is_heard_elsewhere.load(Ordering::Relaxed)
            || self.here.matching_status().wait().is_ok_and(|status| status.matching())
    }

    /// Sends one message, as [`Topic::publish`] does.
    pub fn publish(&self, message: &M, clock: Clock) {
        self.topic.publish(message, clock);
    }
}

/// A typed subscriber: refuses by length and encoding before it copies a byte, decodes and validates when it is read;
/// what is not ours is counted and passed over.
pub struct Inbox<M> {
    _subscriber: Subscriber<()>,
    waiting: Arc<ByteRing<Vec<u8>>>,
    refusing: Refusing,
    /// Which messages are read; the others are passed over.
    accept: Option<Accept<M>>,
    /// Why the newest message that was read is none, if it is.
    newest_refused: Mutex<Option<Reject>>,
}

/// Whether a message is read.
type Accept<M> = Box<dyn Fn(&M) -> bool + Send + Sync>;

impl<M: Message> Inbox<M> {
    /// Subscribes to `key`.
    pub fn new(session: &Session, key: &str) -> Result<Self, TopicError> {
        Self::counted(session, key, &Arc::default())
    }

    /// Subscribes to `key`; what is refused is added to `counts`.
    pub fn counted(session: &Session, key: &str, counts: &Arc<ServeCounts>) -> Result<Self, TopicError> {
        let (feeder, waiting) = ByteRing::new(INBOX, inbox_bytes(M::MAX_BYTES));
        let refusing = Refusing::new(key, counts);
        let admission = refusing.clone();
        let subscriber = session
            .declare_subscriber(key.to_owned())
            .callback(move |sample| {
                let payload = sample.payload();
                match M::admit(payload.len(), Some(&sample.encoding().to_string())) {
                    // A copy, because the bytes received hold on to the whole batch that they came in.
                    Ok(()) => drop(feeder.push(payload.len(), payload.to_bytes().into_owned())),
                    Err(reject) => admission.refuse(&reject),
                }
            })
            .wait()
            .map_err(TopicError::on(key))?;
        let newest_refused = Mutex::default();
        Ok(Self { _subscriber: subscriber, waiting, refusing, accept: None, newest_refused })
    }

    /// The same, but of the messages that come only those are read that `accept` takes.
    #[must_use]
    pub fn only(mut self, accept: impl Fn(&M) -> bool + Send + Sync + 'static) -> Self {
        self.accept = Some(Box::new(accept));
        self
    }

    fn decode(&self, bytes: &[u8]) -> Option<M> {
        let decoded = M::decode(bytes, None).inspect_err(|reject| self.refusing.refuse(reject));
        *locked(&self.newest_refused) = decoded.as_ref().err().cloned();
        let message = decoded.ok()?;
        self.accept.as_ref().is_none_or(|accept| accept(&message)).then_some(message)
    }

    /// Why the newest message that was read was refused; nothing if it was not.
    pub fn refused(&self) -> Option<Reject> {
        locked(&self.newest_refused).clone()
    }

    /// The next message in order; `None` once the session is closed. Cancel-safe.
    pub async fn next(&self) -> Option<M> {
        loop {
            let bytes = self.waiting.next().await?;
            if let Some(message) = self.decode(&bytes) {
                return Some(message);
            }
        }
    }

    /// The next message already here, in order.
    pub fn try_next(&self) -> Option<M> {
        while let Some(bytes) = self.waiting.pop() {
            if let Some(message) = self.decode(&bytes) {
                return Some(message);
            }
        }
        None
    }
}

/// Most bytes that wait for a reader of messages of at most `message` bytes.
fn inbox_bytes(message: usize) -> usize {
    (INBOX * message).min(INBOX_BYTES.max(2 * message))
}

/// Counts what is refused on one key, and says so, but the less often the more there is.
#[derive(Clone)]
pub(crate) struct Refusing {
    key: Arc<str>,
    counts: Arc<ServeCounts>,
    refused: Arc<AtomicU64>,
}

impl Refusing {
    /// Nothing has been refused on `key`; what will be is added to `counts`.
    pub(crate) fn new(key: &str, counts: &Arc<ServeCounts>) -> Self {
        Self { key: key.into(), counts: Arc::clone(counts), refused: Arc::default() }
    }

    /// One more message is refused.
    pub(crate) fn refuse(&self, reject: &Reject) {
        self.counts.refuse(reject);
        let refused = self.refused.fetch_add(1, Ordering::Relaxed) + 1;
        if refused.is_power_of_two() {
            tracing::warn!(key = %self.key, %reject, refused, "message refused");
        }
    }
}
