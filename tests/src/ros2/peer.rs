//! A node of ROS, made of the codec and a plain session.

use std::sync::atomic::{AtomicI64, AtomicU64, Ordering};
use std::sync::{Arc, Mutex};
use std::time::Duration;

use curionav_ros2::attachment::Attachment;
use curionav_ros2::dialect::{Dialect, RmwZenoh, outgoing};
use curionav_ros2::interface::{Distribution, Interface};
use curionav_ros2::message::Message;
use curionav_ros2::qos::Qos;
use curionav_ros2::token::{Endpoint, EntityKind, Token};
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::locked::locked;
use curionav_runtime::session;
use zenoh::liveliness::LivelinessToken;
use zenoh::pubsub::Subscriber;
use zenoh::qos::CongestionControl;
use zenoh::{Session, Wait};
use zenoh_ext::{
    AdvancedPublisher, AdvancedPublisherBuilderExt, AdvancedSubscriber, AdvancedSubscriberBuilderExt,
    CacheConfig, HistoryConfig, MissDetectionConfig, RecoveryConfig,
};

use crate::end_to_end::program::LIMIT;

pub(super) const DIALECT: RmwZenoh = RmwZenoh { domain: 0, distribution: Distribution::Kilted };

/// A node.
pub(super) struct Peer {
    pub(super) session: Session,
    namespace: String,
    entities: AtomicU64,
    sequence: AtomicI64,
    tokens: Mutex<Vec<LivelinessToken>>,
}

/// What a subscriber has heard. A listener of ROS would have ended its process on what is malformed.
pub(super) struct Heard<M> {
    pub(super) messages: Arc<Mutex<Vec<M>>>,
    pub(super) malformed: Arc<AtomicU64>,
    _plain: Option<Subscriber<()>>,
    _kept: Option<AdvancedSubscriber<()>>,
}

impl<M: Message + Clone + Send + 'static> Heard<M> {
    pub(super) fn newest(&self) -> Option<M> {
        locked(&self.messages).last().cloned()
    }

    pub(super) fn count(&self) -> usize {
        locked(&self.messages).len()
    }

    /// Waits until something is heard that is such; what comes first is looked at first, also what has come before.
    pub(super) async fn that(&self, is: impl Fn(&M) -> bool) -> M {
        let wait = async {
            loop {
                if let Some(found) = locked(&self.messages).iter().find(|message| is(message)) {
                    return found.clone();
                }
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        tokio::time::timeout(LIMIT, wait).await.unwrap_or_else(|_| panic!("{} does not come", M::NAME))
    }
}

impl Peer {
    pub(super) async fn new(endpoint: &str, namespace: &str) -> Self {
        let config = ServiceConfig { connect: vec![endpoint.to_owned()], ..ServiceConfig::default() };
        let session = session::client(&config).await.unwrap();
        Self {
            session,
            namespace: namespace.to_owned(),
            entities: AtomicU64::new(1),
            sequence: AtomicI64::new(1),
            tokens: Mutex::default(),
        }
    }

    pub(super) fn topic(&self, name: &str) -> String {
        if name.starts_with('/') { name.to_owned() } else { format!("{}/{name}", self.namespace) }
    }

    fn declare<M: Message>(&self, kind: EntityKind, topic: &str, qos: Qos) {
        let endpoint = Endpoint {
            topic: self.topic(topic),
            type_name: M::INTERFACE.dds(),
            hash: M::INTERFACE.hash(Distribution::Kilted).to_owned(),
            qos,
        };
        self.declare_token(kind, Some(endpoint));
    }

    pub(super) fn declare_token(&self, kind: EntityKind, endpoint: Option<Endpoint>) {
        let token = Token {
            domain: 0,
            session: self.session.zid().to_string(),
            node_id: 0,
            entity_id: self.entities.fetch_add(1, Ordering::Relaxed),
            kind,
            enclave: String::new(),
            namespace: self.namespace.clone(),
            node: "base".into(),
            endpoint,
        };
        let declared = self.session.liveliness().declare_token(token.to_string()).wait().unwrap();
        locked(&self.tokens).push(declared);
    }

    fn attachment(&self) -> Attachment {
        Attachment { sequence: self.sequence.fetch_add(1, Ordering::Relaxed), stamp_ns: 1, gid: [9; 16] }
    }

    pub(super) fn put<M: Message>(&self, topic: &str, message: &M) {
        let sent = outgoing(&DIALECT, message, self.attachment()).unwrap();
        let key = DIALECT.key(&self.topic(topic), &M::INTERFACE);
        // What is said once must not be lost behind a map that is still on its way.
        let put = self.session.put(key, sent.payload()).attachment(sent.attachment());
        put.congestion_control(CongestionControl::Block).wait().unwrap();
    }

    /// A publisher of what is kept for late subscribers, with a first message.
    pub(super) fn latched<M: Message>(&self, topic: &str, message: &M) -> AdvancedPublisher<'static> {
        let key = DIALECT.key(&self.topic(topic), &M::INTERFACE);
        let heartbeat = MissDetectionConfig::default().sporadic_heartbeat(Duration::from_millis(500));
        let publisher = self
            .session
            .declare_publisher(key)
            .cache(CacheConfig::default().max_samples(1))
            .sample_miss_detection(heartbeat)
            .publisher_detection()
            .wait()
            .unwrap();
        self.declare::<M>(EntityKind::Publisher, topic, Qos::LATCHED);
        let sent = outgoing(&DIALECT, message, self.attachment()).unwrap();
        publisher.put(sent.payload()).attachment(sent.attachment()).wait().unwrap();
        publisher
    }

    pub(super) fn hear<M: Message + Send + 'static>(&self, topic: &str, qos: Qos) -> Heard<M> {
        let key = DIALECT.key(&self.topic(topic), &M::INTERFACE);
        let messages = Arc::<Mutex<Vec<M>>>::default();
        let malformed = Arc::<AtomicU64>::default();
        let (kept, wrong) = (Arc::clone(&messages), Arc::clone(&malformed));
        let take = move |sample: zenoh::sample::Sample| {
            let attached = sample.attachment().map(|bytes| bytes.to_bytes());
            let legal = DIALECT.attachment(attached.as_deref()).is_ok();
            match M::decode(&sample.payload().to_bytes()) {
                Ok(message) if legal => locked(&kept).push(message),
                _ => drop(wrong.fetch_add(1, Ordering::Relaxed)),
            }
        };
        let subscriber = self.session.declare_subscriber(key).callback(take);
        let (mut heard_plain, mut heard_kept) = (None, None);
        if qos.transient_local {
            let kept = subscriber
                .history(HistoryConfig::default().detect_late_publishers().max_samples(1))
                .recovery(RecoveryConfig::default().heartbeat())
                .subscriber_detection();
            heard_kept = Some(kept.wait().unwrap());
        } else {
            heard_plain = Some(subscriber.wait().unwrap());
        }
        self.declare::<M>(EntityKind::Subscriber, topic, qos);
        Heard { messages, malformed, _plain: heard_plain, _kept: heard_kept }
    }

    /// Calls a service and waits for its response.
    pub(super) async fn call<Q: Message, A: Message>(&self, name: &str, request: &Q) -> A {
        self.call_of(&Q::INTERFACE, name, request).await
    }

    /// The same for a service whose type differs from that of the request: results are asked for alike of all actions.
    pub(super) async fn call_of<Q: Message, A: Message>(
        &self,
        interface: &Interface,
        name: &str,
        request: &Q,
    ) -> A {
        let sent = outgoing(&DIALECT, request, self.attachment()).unwrap();
        let key = DIALECT.key(&self.topic(name), interface);
        let asked = Attachment::decode(sent.attachment().unwrap()).unwrap();
        let replies =
            self.session.get(key).payload(sent.payload()).attachment(sent.attachment()).timeout(LIMIT);
        let replies = replies.wait().unwrap();
        let reply = tokio::time::timeout(LIMIT, replies.recv_async()).await.expect("it is answered").unwrap();
        let sample = reply.into_result().unwrap();
        let echoed = Attachment::decode(&sample.attachment().unwrap().to_bytes()).unwrap();
        assert_eq!(
            (echoed.sequence, echoed.gid),
            (asked.sequence, asked.gid),
            "a response names its request"
        );
        A::decode(&sample.payload().to_bytes()).unwrap()
    }
}
