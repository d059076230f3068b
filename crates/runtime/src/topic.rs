//! Typed publish/subscribe.

use std::marker::PhantomData;
use std::sync::Arc;

use curionav_schemas::{Clock, Message};
use zenoh::handlers::{RingChannel, RingChannelHandler};
use zenoh::key_expr::KeyExpr;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::{CongestionControl, Priority};
use zenoh::sample::Sample;
use zenoh::{Session, Wait};

use crate::serve::ServeCounts;

/// Messages a subscriber may have waiting; beyond it the oldest goes. In lockstep the robot waits for what its
/// services need of each other, so that at most a few of these are in flight, but nothing waits for a reader of
/// reports. In real time only the newest matters.
const INBOX: usize = 256;

/// How a stream travels (the QoS column of the key table in `schemas/README.md`).
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Flow {
    /// Sensor data and beliefs: newest wins, dropped under pressure.
    Sensor,
    /// Decisions and commands: first in line, sent at once, never dropped.
    Control,
    /// Missions and run states: not urgent, never dropped.
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

    /// Sends one message. In lockstep nothing that matters may be lost, so every flow but glimpses blocks; in real
    /// time sensor data and reports are dropped rather than waited for.
    pub fn publish(&self, message: &M, clock: Clock) {
        let realtime = clock == Clock::Realtime;
        let (priority, drops, express) = match self.flow {
            Flow::Sensor => (Priority::InteractiveHigh, realtime, true),
            Flow::Control => (Priority::RealTime, false, true),
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
    /// Is told by the network whether there is a subscriber.
    listeners: Publisher<'static>,
}

impl<M: Message> OnDemand<M> {
    /// A publisher on `key`.
    pub fn new(session: &Session, key: &str, flow: Flow) -> Result<Self, TopicError> {
        let topic = Topic::new(session, key, flow)?;
        let listeners = session.declare_publisher(key.to_owned()).wait().map_err(TopicError::on(key))?;
        Ok(Self { topic, listeners })
    }

    /// Whether something listens; no if that is not known.
    pub fn is_heard(&self) -> bool {
        self.listeners.matching_status().wait().is_ok_and(|status| status.matching())
    }

    /// Sends one message, as [`Topic::publish`] does.
    pub fn publish(&self, message: &M, clock: Clock) {
        self.topic.publish(message, clock);
    }
}

/// A typed subscriber: decodes and validates; what is not ours is counted and passed over.
pub struct Inbox<M> {
    subscriber: Subscriber<RingChannelHandler<Sample>>,
    counts: Arc<ServeCounts>,
    message: PhantomData<fn() -> M>,
}

impl<M: Message> Inbox<M> {
    /// Subscribes to `key`.
    pub fn new(session: &Session, key: &str) -> Result<Self, TopicError> {
        Self::counted(session, key, &Arc::default())
    }

    /// Subscribes to `key`; what is refused is added to `counts`.
    pub fn counted(session: &Session, key: &str, counts: &Arc<ServeCounts>) -> Result<Self, TopicError> {
        let subscriber = session
            .declare_subscriber(key.to_owned())
            .with(RingChannel::new(INBOX))
            .wait()
            .map_err(TopicError::on(key))?;
        Ok(Self { subscriber, counts: Arc::clone(counts), message: PhantomData })
    }

    fn decode(&self, sample: &Sample) -> Option<M> {
        let encoding = sample.encoding().to_string();
        match M::decode(&sample.payload().to_bytes(), Some(&encoding)) {
            Ok(message) => Some(message),
            Err(error) => {
                self.counts.refuse(&error);
                let refused = self.counts.refused.total();
                tracing::warn!(key = %sample.key_expr(), %error, refused, "message refused");
                None
            }
        }
    }

    /// The next message in order; `None` once the session is closed. Cancel-safe.
    pub async fn next(&self) -> Option<M> {
        loop {
            let sample = self.subscriber.recv_async().await.ok()?;
            if let Some(message) = self.decode(&sample) {
                return Some(message);
            }
        }
    }

    /// The next message already here, in order.
    pub fn try_next(&self) -> Option<M> {
        while let Ok(Some(sample)) = self.subscriber.try_recv() {
            if let Some(message) = self.decode(&sample) {
                return Some(message);
            }
        }
        None
    }
}
