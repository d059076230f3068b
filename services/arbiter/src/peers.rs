//! What a cycle needs of the world: replicas addressed one by one, each on its own key, and time.

use std::future::Future;
use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_runtime::membership::Membership;
use curionav_runtime::query::{AskError, Urgency, ask};
use curionav_schemas::{Clock, EvaluateRequest, GenerateReply, GenerateRequest, Scores, keys};
use zenoh::Session;

/// Role of trajectory generators; evaluators have their metric's name.
pub use curionav_runtime::generator::ROLE as GENERATOR;

/// The world behind the arbiter. Production asks over Zenoh and lives in real time; tests answer from
/// memory and in a time of their own, so that a cycle is a function of what they answer and when.
pub trait Peers: Send + Sync + 'static {
    /// Time since some fixed moment; it never runs backwards.
    fn now(&self) -> Duration;

    /// Completes after `time`.
    fn sleep(&self, time: Duration) -> impl Future<Output = ()> + Send;

    /// Does work that takes long without waiting for anything.
    fn compute<R>(&self, work: impl FnOnce() -> R) -> R;

    /// Instances of `role` that are alive, in order.
    fn alive(&self, role: &str) -> Vec<String>;

    /// Completes when somebody has come or gone since it completed last.
    fn membership_changed(&self) -> impl Future<Output = ()> + Send;

    /// Asks one generator, for a robot whose time passes as `clock` says.
    fn generate(
        &self,
        instance: &str,
        request: &GenerateRequest,
        timeout: Duration,
        clock: Clock,
    ) -> impl Future<Output = Result<GenerateReply, AskError>> + Send;

    /// Asks one evaluator, for a robot whose time passes as `clock` says.
    fn evaluate(
        &self,
        metric: &str,
        instance: &str,
        request: &EvaluateRequest,
        timeout: Duration,
        clock: Clock,
    ) -> impl Future<Output = Result<Scores, AskError>> + Send;
}

/// Peers over Zenoh.
pub struct ZenohPeers {
    session: Session,
    membership: Membership,
    changes: tokio::sync::Mutex<tokio::sync::watch::Receiver<curionav_runtime::membership::Members>>,
    started: Instant,
}

impl ZenohPeers {
    /// Those behind `session`.
    pub fn new(session: &Session) -> anyhow::Result<Arc<Self>> {
        let membership = Membership::follow(session)?;
        let changes = tokio::sync::Mutex::new(membership.changes());
        Ok(Arc::new(Self { session: session.clone(), membership, changes, started: Instant::now() }))
    }
}

impl Peers for ZenohPeers {
    fn now(&self) -> Duration {
        self.started.elapsed()
    }

    async fn sleep(&self, time: Duration) {
        tokio::time::sleep(time).await;
    }

    fn compute<R>(&self, work: impl FnOnce() -> R) -> R {
        tokio::task::block_in_place(work)
    }

    fn alive(&self, role: &str) -> Vec<String> {
        self.membership.of(role)
    }

    async fn membership_changed(&self) {
        if self.changes.lock().await.changed().await.is_err() {
            // The session is closed: nothing will change any more.
            std::future::pending::<()>().await;
        }
    }

    async fn generate(
        &self,
        instance: &str,
        request: &GenerateRequest,
        timeout: Duration,
        clock: Clock,
    ) -> Result<GenerateReply, AskError> {
        let key = keys::generate(instance).map_err(|e| AskError::Send(e.to_string()))?;
        ask(&self.session, &key, request, timeout, Urgency::Shard { robot: &request.robot, clock }).await
    }

    async fn evaluate(
        &self,
        metric: &str,
        instance: &str,
        request: &EvaluateRequest,
        timeout: Duration,
        clock: Clock,
    ) -> Result<Scores, AskError> {
        let key = keys::evaluate(metric, instance).map_err(|e| AskError::Send(e.to_string()))?;
        ask(&self.session, &key, request, timeout, Urgency::Shard { robot: &request.robot, clock }).await
    }
}
