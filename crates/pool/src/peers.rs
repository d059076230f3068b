//! What a cycle needs of the world: replicas addressed one by one, each on its own key, and time.

use std::future::Future;
use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_planning::terms;
use curionav_runtime::membership::{Members, Membership};
use curionav_runtime::metrics::Tally;
use curionav_runtime::query::{AskError, Urgency, ask_counted};
use curionav_schemas::{Clock, EvaluateRequest, GenerateReply, GenerateRequest, Message, Scores, keys};
use tokio::sync::{Mutex, watch};
use zenoh::Session;

use crate::budget::Budget;
use crate::question::{EvaluateQuestion, GenerateQuestion};

/// The world behind the arbiter. Production asks over Zenoh and lives in real time; tests answer from
/// memory and in a time of their own, so that a cycle is a function of what they answer and when.
pub trait Peers: Send + Sync + 'static {
    /// Time since some fixed moment; it never runs backwards.
    fn now(&self) -> Duration;

    /// Completes after `time`.
    fn sleep(&self, time: Duration) -> impl Future<Output = ()> + Send;

    /// Does work that takes long without waiting for anything.
    fn compute<R>(&self, work: impl FnOnce() -> R) -> R;

    /// Follows from now on which instances of these roles are alive, besides those that it follows anyway.
    fn follow(&self, roles: &[&str]);

    /// Instances of `role` that are alive, in order.
    fn alive(&self, role: &str) -> Vec<String>;

    /// Completes when a replica has come or gone since it completed last.
    fn membership_changed(&self) -> impl Future<Output = ()> + Send;

    /// Asks one generator.
    fn generate(
        &self,
        call: Call<'_>,
        question: &GenerateQuestion<'_>,
    ) -> impl Future<Output = Result<GenerateReply, AskError>> + Send;

    /// Asks one evaluator of a term.
    fn evaluate(
        &self,
        term: &str,
        call: Call<'_>,
        question: &EvaluateQuestion<'_>,
    ) -> impl Future<Output = Result<Scores, AskError>> + Send;
}

/// Which replica is asked, for which robot, and how long the answer is waited for.
#[derive(Debug, Clone, Copy)]
pub struct Call<'a> {
    /// The replica.
    pub instance: &'a str,
    /// The robot: replicas serve robots in turn.
    pub robot: &'a str,
    /// From now on.
    pub timeout: Duration,
    /// How the robot's time passes.
    pub clock: Clock,
}

impl Call<'_> {
    /// The time for the answer as the question says it.
    pub fn budget_ms(&self) -> u32 {
        Budget::ms(self.timeout)
    }
}

/// Peers over Zenoh.
pub struct ZenohPeers {
    session: Session,
    membership: Membership,
    changes: Mutex<watch::Receiver<Members>>,
    started: Instant,
    /// See [`curionav_runtime::config::ServiceConfig::takes_turns`].
    takes_turns: bool,
    /// Questions sent, by role, probes and those asked twice included.
    pub questions: Tally,
    /// Bytes of the questions, by role; without what Zenoh and the link add.
    pub sent: Tally,
    /// Bytes of the answers that came, by role.
    pub received: Tally,
}

impl ZenohPeers {
    /// Those behind `session`. With `takes_turns` nothing else of this process waits to be done while one computes.
    pub fn new(session: &Session, takes_turns: bool) -> anyhow::Result<Arc<Self>> {
        // Terms that are not built in are added with the missions that have them.
        let built_in: Vec<&str> = terms::NAMES
            .iter()
            .copied()
            .filter(|term| !terms::is_local(term))
            .chain([keys::GENERATOR])
            .collect();
        let membership = Membership::follow_roles(session, &built_in)?;
        let changes = Mutex::new(membership.changes());
        Ok(Arc::new(Self {
            session: session.clone(),
            membership,
            changes,
            started: Instant::now(),
            takes_turns,
            questions: Tally::new(&["pool"]),
            sent: Tally::new(&["pool"]),
            received: Tally::new(&["pool"]),
        }))
    }

    async fn ask<Q: Message, A: Message>(
        &self,
        role: &str,
        call: Call<'_>,
        question: Vec<u8>,
    ) -> Result<A, AskError> {
        let Call { instance, robot, timeout, clock } = call;
        let key = keys::question(role, instance, robot).map_err(|e| AskError::Send(e.to_string()))?;
        self.questions.add(&[role]);
        self.sent.add_many(&[role], question.len() as u64);
        let urgency = Urgency::Shard { clock };
        let (answer, received) = ask_counted::<Q, A>(&self.session, &key, question, timeout, urgency).await;
        self.received.add_many(&[role], received);
        answer
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
        if self.takes_turns { work() } else { tokio::task::block_in_place(work) }
    }

    fn follow(&self, roles: &[&str]) {
        for role in roles {
            if let Err(error) = self.membership.also(role) {
                tracing::error!(role, %error, "no replica of this role will be found");
            }
        }
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
        call: Call<'_>,
        question: &GenerateQuestion<'_>,
    ) -> Result<GenerateReply, AskError> {
        let bytes = question.encode(call.budget_ms());
        self.ask::<GenerateRequest, _>(question.role(), call, bytes).await
    }

    async fn evaluate(
        &self,
        term: &str,
        call: Call<'_>,
        question: &EvaluateQuestion<'_>,
    ) -> Result<Scores, AskError> {
        let bytes = question.encode(call.budget_ms());
        self.ask::<EvaluateRequest, _>(term, call, bytes).await
    }
}
