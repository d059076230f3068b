//! Whom the arbiter asks: replicas addressed one by one, each on its own key.

use std::collections::{BTreeMap, BTreeSet};
use std::future::Future;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use curionav_runtime::query::{AskError, Urgency, ask};
use curionav_schemas::{EvaluateRequest, GenerateReply, GenerateRequest, Scores, keys};
use zenoh::Session;

/// Role of trajectory generators; evaluators have their metric's name.
pub use curionav_runtime::generator::ROLE as GENERATOR;

/// The replicas behind the arbiter. Production asks over Zenoh; tests answer from memory.
pub trait Peers: Send + Sync + 'static {
    /// Instances of `role` that are alive and warm for the current mission, in order.
    fn warm(&self, role: &str) -> Vec<String>;

    /// Asks one generator.
    fn generate(
        &self,
        instance: &str,
        request: &GenerateRequest,
        timeout: Duration,
    ) -> impl Future<Output = Result<GenerateReply, AskError>> + Send;

    /// Asks one evaluator.
    fn evaluate(
        &self,
        metric: &str,
        instance: &str,
        request: &EvaluateRequest,
        timeout: Duration,
    ) -> impl Future<Output = Result<Scores, AskError>> + Send;
}

/// Peers over Zenoh.
pub struct ZenohPeers {
    session: Session,
    warm: Mutex<BTreeMap<String, BTreeSet<String>>>,
}

impl ZenohPeers {
    /// Nobody is warm yet.
    pub fn new(session: &Session) -> Self {
        Self { session: session.clone(), warm: Mutex::new(BTreeMap::new()) }
    }

    /// Marks an instance as warm for the current mission, or as gone.
    pub fn set_warm(&self, role: &str, instance: &str, warm: bool) {
        let mut all = self.warm.lock().unwrap_or_else(PoisonError::into_inner);
        let instances = all.entry(role.to_owned()).or_default();
        if warm {
            instances.insert(instance.to_owned());
        } else {
            instances.remove(instance);
        }
    }

    /// Forgets who is warm: the mission has changed.
    pub fn clear(&self) {
        self.warm.lock().unwrap_or_else(PoisonError::into_inner).clear();
    }
}

impl Peers for ZenohPeers {
    fn warm(&self, role: &str) -> Vec<String> {
        let all = self.warm.lock().unwrap_or_else(PoisonError::into_inner);
        all.get(role).map(|s| s.iter().cloned().collect()).unwrap_or_default()
    }

    async fn generate(
        &self,
        instance: &str,
        request: &GenerateRequest,
        timeout: Duration,
    ) -> Result<GenerateReply, AskError> {
        let key = keys::generate(instance).map_err(|e| AskError::Send(e.to_string()))?;
        ask(&self.session, &key, request, timeout, Urgency::Shard).await
    }

    async fn evaluate(
        &self,
        metric: &str,
        instance: &str,
        request: &EvaluateRequest,
        timeout: Duration,
    ) -> Result<Scores, AskError> {
        let key = keys::evaluate(metric, instance).map_err(|e| AskError::Send(e.to_string()))?;
        ask(&self.session, &key, request, timeout, Urgency::Shard).await
    }
}
