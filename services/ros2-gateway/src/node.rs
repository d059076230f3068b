//! The gateway's node: what ROS sees of it, and how it speaks and listens there.

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::{Duration, SystemTime, UNIX_EPOCH};

use anyhow::anyhow;
use curionav_ros2::attachment::Attachment;
use curionav_ros2::cdr::CdrError;
use curionav_ros2::dialect::{Dialect, Outgoing, outgoing};
use curionav_ros2::interface::Interface;
use curionav_ros2::message::Message;
use curionav_ros2::qos::Qos;
use curionav_ros2::token::{Endpoint, EntityKind, Token};
use curionav_runtime::byte_ring::ByteRing;
use curionav_runtime::locked::locked;
use curionav_runtime::metrics::Tally;
use curionav_schemas::limits::MAX_TEXT;
use zenoh::bytes::ZBytes;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::{Publisher, Subscriber};
use zenoh::qos::CongestionControl;
use zenoh::query::{Query, Queryable};
use zenoh::sample::Locality;
use zenoh::{Session, Wait};
use zenoh_ext::{
    AdvancedPublisher, AdvancedPublisherBuilderExt, AdvancedSubscriber, AdvancedSubscriberBuilderExt,
    CacheConfig, HistoryConfig, MissDetectionConfig, RecoveryConfig,
};

use crate::config::Ros2Config;
use crate::fault::{Fault, FaultKind};
use crate::problem::{Problem, ProblemKind, Problems};

/// Messages of one topic that wait: of odometry at a hundred hertz as many as come in half a second. The oldest go.
const WAITING: usize = 64;
/// Bytes that these may have, but for room for one of the largest.
const WAITING_BYTES: usize = 2 << 20;
/// How often publishers of what is kept say what they have sent last, as rmw does.
const HEARTBEAT: Duration = Duration::from_millis(500);
/// A large map over a slow link.
const HISTORY_TIMEOUT: Duration = Duration::from_secs(20);

/// A node of ROS over one session.
pub(crate) struct Node {
    session: Session,
    dialect: Arc<dyn Dialect>,
    config: Ros2Config,
    entities: AtomicU64,
    _token: Option<LivelinessToken>,
    /// What was refused, by topic and kind of fault.
    pub(crate) refused: Tally,
    /// Where it is said that a message is too long.
    problems: Arc<Mutex<Problems>>,
}

/// Nanoseconds since 1970 on this machine.
fn now_ns() -> i64 {
    let since = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    i64::try_from(since.as_nanos()).unwrap_or(i64::MAX)
}

impl Node {
    /// A node that nothing has been declared for yet; what it refuses is added to `refused`, by topic and fault.
    ///
    /// # Errors
    /// If its token cannot be declared.
    pub(crate) fn new(
        session: &Session,
        config: &Ros2Config,
        refused: Tally,
        problems: Arc<Mutex<Problems>>,
    ) -> anyhow::Result<Self> {
        let mut node = Self {
            session: session.clone(),
            dialect: config.dialect().into(),
            config: config.clone(),
            entities: AtomicU64::new(1),
            _token: None,
            refused,
            problems,
        };
        let own = node.token(0, EntityKind::Node, None);
        node._token = node.declare_token(&own)?;
        Ok(node)
    }

    fn token(&self, entity_id: u64, kind: EntityKind, endpoint: Option<Endpoint>) -> Token {
        let namespace = match self.config.namespace.trim_matches('/') {
            "" => String::new(),
            namespace => format!("/{namespace}"),
        };
        Token {
            domain: self.config.domain,
            session: self.session.zid().to_string(),
            node_id: 0,
            entity_id,
            kind,
            enclave: String::new(),
            namespace,
            node: self.config.node.clone(),
            endpoint,
        }
    }

    fn declare_token(&self, token: &Token) -> anyhow::Result<Option<LivelinessToken>> {
        let Some(key) = self.dialect.token_key(token) else { return Ok(None) };
        let declared = self.session.liveliness().declare_token(key.clone()).wait();
        declared.map(Some).map_err(|error| anyhow!("{key}: {error}"))
    }

    /// The number of the next entity, and the token that says what it is.
    fn entity(
        &self,
        kind: EntityKind,
        topic: &str,
        interface: &Interface,
        qos: Qos,
    ) -> anyhow::Result<(u64, Option<LivelinessToken>)> {
        let id = self.entities.fetch_add(1, Ordering::Relaxed);
        let endpoint = Endpoint {
            topic: topic.to_owned(),
            type_name: interface.dds(),
            hash: interface.hash(self.config.distribution()).to_owned(),
            qos,
        };
        let token = self.token(id, kind, Some(endpoint));
        Ok((id, self.declare_token(&token)?))
    }

    /// A name that no other sender has: that of the session, with the entity's number in it.
    fn gid(&self, entity: u64) -> [u8; 16] {
        let mut gid = self.session.zid().to_le_bytes();
        gid.iter_mut().zip(entity.to_le_bytes()).for_each(|(byte, number)| *byte ^= number);
        gid
    }

    /// A publisher on a topic, by its name in the configuration.
    ///
    /// # Errors
    /// If it cannot be declared.
    pub(crate) fn outlet<M: Message>(&self, topic: &str, qos: Qos) -> anyhow::Result<Outlet<M>> {
        let topic = self.config.resolve(topic);
        let key = self.dialect.key(&topic, &M::INTERFACE);
        let fault = |error: zenoh::Error| anyhow!("{key}: {error}");
        let publisher = self.session.declare_publisher(key.clone());
        let publisher = publisher.congestion_control(CongestionControl::Drop).express(true);
        let publisher = if qos.transient_local {
            let kept = publisher
                .cache(CacheConfig::default().max_samples(qos.depth as usize))
                .sample_miss_detection(MissDetectionConfig::default().sporadic_heartbeat(HEARTBEAT))
                .publisher_detection();
            Kind::Kept(kept.wait().map_err(fault)?)
        } else {
            Kind::Plain(publisher.wait().map_err(fault)?)
        };
        let (entity, token) = self.entity(EntityKind::Publisher, &topic, &M::INTERFACE, qos)?;
        let gid = self.gid(entity);
        let dialect = Arc::clone(&self.dialect);
        Ok(Outlet {
            publisher,
            dialect,
            gid,
            sent: AtomicI64::new(0),
            _token: token,
            message: Default::default(),
        })
    }

    /// A subscriber on a topic, by its name in the configuration. What is too long or has no attachment is refused
    /// before it is copied.
    ///
    /// # Errors
    /// If it cannot be declared.
    pub(crate) fn intake<M: Message>(&self, topic: &str, qos: Qos) -> anyhow::Result<Intake<M>> {
        let name = self.config.resolve(topic);
        let key = self.dialect.key(&name, &M::INTERFACE);
        let fault = |error: zenoh::Error| anyhow!("{key}: {error}");
        let (feeder, waiting) = ByteRing::new(WAITING, WAITING_BYTES.max(2 * M::MAX_BYTES));
        let dialect = Arc::clone(&self.dialect);
        let refused = self.refused.clone();
        let label = name.clone();
        let problems = Arc::clone(&self.problems);
        // What this gateway itself says is not heard.
        let subscriber = self.session.declare_subscriber(key.clone()).allowed_origin(Locality::Remote);
        let subscriber = subscriber.callback(move |sample| {
            let payload = sample.payload();
            if payload.len() > M::MAX_BYTES {
                let detail =
                    format!("it is too large: {} bytes; the most is {}", payload.len(), M::MAX_BYTES);
                locked(&problems).set(Problem::new(ProblemKind::NotUsed, label.as_str(), detail));
                return refused.add(&[&label, FaultKind::TooLong.code()]);
            }
            if !is_attached(&*dialect, sample.attachment()) {
                return refused.add(&[&label, FaultKind::Malformed.code()]);
            }
            // A copy, because the bytes received hold on to the whole batch that they came in.
            feeder.push(payload.len(), payload.to_bytes().into_owned());
        });
        let subscriber = if qos.transient_local {
            let history = HistoryConfig::default().detect_late_publishers().max_samples(qos.depth as usize);
            let kept = subscriber
                .history(history)
                .recovery(RecoveryConfig::default().heartbeat())
                .query_timeout(HISTORY_TIMEOUT)
                .subscriber_detection();
            Listening::Kept(kept.wait().map_err(fault)?)
        } else {
            Listening::Plain(subscriber.wait().map_err(fault)?)
        };
        let (_, token) = self.entity(EntityKind::Subscriber, &name, &M::INTERFACE, qos)?;
        let refused = self.refused.clone();
        let problems = Arc::clone(&self.problems);
        Ok(Intake {
            _subscriber: subscriber,
            waiting,
            refused,
            problems,
            topic: name,
            _token: token,
            message: Default::default(),
        })
    }

    /// The serving end of a service, by its name below the outer slash.
    ///
    /// # Errors
    /// If it cannot be declared.
    pub(crate) fn service<Q: Message + 'static>(&self, name: &str) -> anyhow::Result<Serving<Q>> {
        self.serving(name, &Q::INTERFACE, Q::MAX_BYTES, Box::new(Q::decode))
    }

    /// The serving end of a service of this type, whose requests of at most `most` bytes are read by `decode`.
    ///
    /// # Errors
    /// If it cannot be declared.
    pub(crate) fn serving<T>(
        &self,
        name: &str,
        interface: &Interface,
        most: usize,
        decode: Decode<T>,
    ) -> anyhow::Result<Serving<T>> {
        let name = self.config.resolve(name);
        let key = self.dialect.key(&name, interface);
        let (feeder, waiting) = ByteRing::new(WAITING, WAITING_BYTES);
        let dialect = Arc::clone(&self.dialect);
        let refused = self.refused.clone();
        let label = name.clone();
        let queryable = self.session.declare_queryable(key.clone()).complete(true);
        let queryable = queryable.callback(move |query| {
            let bytes = query.payload().map_or(0, ZBytes::len);
            let beside = query.parameters().as_str().len();
            if bytes > most || beside > MAX_TEXT || !is_attached(&*dialect, query.attachment()) {
                return refused.add(&[&label, FaultKind::Malformed.code()]);
            }
            feeder.push(bytes.max(1 << 10), query);
        });
        let queryable = queryable.wait().map_err(|error| anyhow!("{key}: {error}"))?;
        let (_, token) = self.entity(EntityKind::Service, &name, interface, Qos::DEFAULT)?;
        let dialect = Arc::clone(&self.dialect);
        let refused = self.refused.clone();
        Ok(Serving { _queryable: queryable, waiting, dialect, refused, name, _token: token, decode })
    }
}

/// Whether what has come carries what the dialect attaches.
fn is_attached(dialect: &dyn Dialect, attachment: Option<&ZBytes>) -> bool {
    // An attachment of another length is not looked at.
    let short = attachment.filter(|bytes| bytes.len() <= Attachment::BYTES);
    dialect.attachment(short.map(ZBytes::to_bytes).as_deref()).is_ok()
}

enum Kind {
    Plain(Publisher<'static>),
    Kept(AdvancedPublisher<'static>),
}

/// A publisher of one type.
pub(crate) struct Outlet<M> {
    publisher: Kind,
    dialect: Arc<dyn Dialect>,
    gid: [u8; 16],
    sent: AtomicI64,
    _token: Option<LivelinessToken>,
    message: std::marker::PhantomData<fn(M)>,
}

impl<M: Message> Outlet<M> {
    /// Sends a message. One that no listener could read is not sent; that it is one is this program's own fault.
    pub(crate) fn put(&self, message: &M) {
        let sequence = self.sent.fetch_add(1, Ordering::Relaxed) + 1;
        let attachment = Attachment { sequence, stamp_ns: now_ns(), gid: self.gid };
        let sent = match outgoing(&*self.dialect, message, attachment) {
            Ok(outgoing) => self.send(&outgoing).map_err(|error| error.to_string()),
            Err(error) => Err(error.to_string()),
        };
        if let Err(error) = sent {
            tracing::warn!(message = M::NAME, error, "not sent");
        }
    }

    fn send(&self, outgoing: &Outgoing) -> zenoh::Result<()> {
        let payload = outgoing.payload();
        let attachment = outgoing.attachment();
        match &self.publisher {
            Kind::Plain(publisher) => publisher.put(payload).attachment(attachment).wait(),
            Kind::Kept(publisher) => publisher.put(payload).attachment(attachment).wait(),
        }
    }

    /// Whether something subscribes; no if that is not known.
    pub(crate) fn is_heard(&self) -> bool {
        let status = match &self.publisher {
            Kind::Plain(publisher) => publisher.matching_status().wait(),
            Kind::Kept(publisher) => publisher.matching_status().wait(),
        };
        status.is_ok_and(|status| status.matching())
    }
}

enum Listening {
    Plain(#[expect(dead_code, reason = "it listens for as long as it is held")] Subscriber<()>),
    Kept(#[expect(dead_code, reason = "it listens for as long as it is held")] AdvancedSubscriber<()>),
}

/// A subscriber of one type.
pub(crate) struct Intake<M> {
    _subscriber: Listening,
    waiting: Arc<ByteRing<Vec<u8>>>,
    refused: Tally,
    /// Where it is said why a message is none.
    problems: Arc<Mutex<Problems>>,
    topic: String,
    _token: Option<LivelinessToken>,
    message: std::marker::PhantomData<fn() -> M>,
}

impl<M: Message> Intake<M> {
    /// The next payload in order; nothing once the session is closed. Cancel-safe.
    pub(crate) async fn next_payload(&self) -> Option<Vec<u8>> {
        self.waiting.next().await
    }

    /// The message in a payload; if it is none, that is counted, and said to operators.
    pub(crate) fn decode(&self, payload: &[u8]) -> Option<M> {
        match M::decode(payload) {
            Ok(message) => Some(message),
            Err(error) => {
                let fault = Fault::unread(&error);
                tracing::debug!(topic = self.topic, %error, "message refused");
                self.refused.add(&[&self.topic, fault.kind.code()]);
                let problem = Problem::new(ProblemKind::NotUsed, self.topic.as_str(), fault.to_string());
                locked(&self.problems).set(problem);
                None
            }
        }
    }

    /// The next message in order; nothing once the session is closed. Cancel-safe.
    pub(crate) async fn next(&self) -> Option<M> {
        loop {
            let payload = self.next_payload().await?;
            if let Some(message) = self.decode(&payload) {
                return Some(message);
            }
        }
    }
}

/// What is made of the payload of a request.
pub(crate) type Decode<T> = Box<dyn Fn(&[u8]) -> Result<T, CdrError> + Send + Sync>;

/// The serving end of a service of one type.
pub(crate) struct Serving<T> {
    _queryable: Queryable<()>,
    waiting: Arc<ByteRing<Query>>,
    dialect: Arc<dyn Dialect>,
    refused: Tally,
    name: String,
    _token: Option<LivelinessToken>,
    decode: Decode<T>,
}

/// A request that waits for its response.
pub(crate) struct Request {
    query: Query,
    dialect: Arc<dyn Dialect>,
}

impl<T> Serving<T> {
    /// The next request in order, and where its response goes; nothing once the session is closed. Cancel-safe.
    pub(crate) async fn next(&self) -> Option<(T, Request)> {
        loop {
            let query = self.waiting.next().await?;
            let payload = query.payload().map(ZBytes::to_bytes).unwrap_or_default();
            match (self.decode)(&payload) {
                Ok(request) => {
                    drop(payload);
                    return Some((request, Request { query, dialect: Arc::clone(&self.dialect) }));
                }
                Err(error) => {
                    tracing::debug!(service = self.name, %error, "request refused");
                    self.refused.add(&[&self.name, FaultKind::Malformed.code()]);
                }
            }
        }
    }
}

impl Request {
    /// Sends the response.
    pub(crate) fn reply<A: Message>(&self, answer: &A) {
        let attached = self.query.attachment().map(ZBytes::to_bytes);
        let echoed = self.dialect.attachment(attached.as_deref()).ok().flatten();
        // Without tokens there are no attachments either, and what stands in one does not matter.
        let echoed = echoed.unwrap_or(Attachment { sequence: 0, stamp_ns: 0, gid: [0; 16] });
        let sent = match outgoing(&*self.dialect, answer, Attachment { stamp_ns: now_ns(), ..echoed }) {
            Ok(outgoing) => {
                let reply = self.query.reply(self.query.key_expr().clone(), outgoing.payload());
                reply.attachment(outgoing.attachment()).wait().map_err(|error| error.to_string())
            }
            Err(error) => Err(error.to_string()),
        };
        if let Err(error) = sent {
            tracing::debug!(answer = A::NAME, error, "response not sent");
        }
    }
}
