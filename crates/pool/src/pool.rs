//! Asking the pool: one question to one replica at a time, to another when that one fails or is late, and
//! probes that keep every replica ready.

use std::collections::BTreeMap;
use std::future::Future;
use std::pin::pin;
use std::sync::{Arc, Mutex, MutexGuard};
use std::time::Duration;

use curionav_runtime::locked::locked;
use curionav_runtime::metrics::Tally;
use curionav_runtime::query::AskError;
use curionav_runtime::serve::refusals;
use curionav_schemas::{Clock, Refusal, Reject, keys};
use futures_util::StreamExt;
use futures_util::stream::FuturesUnordered;
use tokio::sync::Notify;

use crate::budget::{Budget, StageTimes};
use crate::context::PlanContext;
use crate::peers::{Call, Peers};
use crate::replicas::{Failure, Probe, Replicas, Wanted};

/// How long a question without candidates is waited for. A replica that takes longer to fetch a map and derive
/// its fields goes on doing so, and answers a later one at once.
const PROBE_TIMEOUT: Duration = Duration::from_millis(800);

/// The replicas behind an arbiter, and what is known of them.
pub struct Pool<P> {
    /// How to reach them.
    pub peers: Arc<P>,
    /// Questions that were of no use, by role and reason.
    pub failures: Tally,
    /// Questions without candidates, by role.
    pub probes: Tally,
    /// Counts what the service has refused; answers that could not be understood are added to it.
    refused: Tally,
    replicas: Mutex<Replicas>,
    stages: Mutex<StageTimes>,
    /// Wakes [`Self::keep_ready`] when a replica has failed a question, because it may have to be probed.
    failed: Notify,
    /// Wakes who waits for [`Self::probed`] when a probe has come back.
    probed: Notify,
    /// Which replica of a role refused the last probe, and why.
    refusals: Mutex<BTreeMap<String, (String, Reject)>>,
}

/// A usable answer, and how much work it was.
#[derive(Debug)]
pub(crate) struct Answer<T> {
    pub(crate) value: T,
    /// Candidates in it.
    pub(crate) count: usize,
    /// What the replica says it computed for.
    pub(crate) busy: Duration,
}

impl<P: Peers> Pool<P> {
    /// No replica is known yet.
    pub fn new(peers: Arc<P>) -> Self {
        Self::counted(peers, refusals())
    }

    /// [`Self::new`], but answers that cannot be understood are counted in `refused`, the service's own count.
    pub fn counted(peers: Arc<P>, refused: Tally) -> Self {
        Self {
            peers,
            failures: Tally::new(&["pool", "reason"]),
            probes: Tally::new(&["pool"]),
            refused,
            replicas: Mutex::default(),
            stages: Mutex::default(),
            failed: Notify::new(),
            probed: Notify::new(),
            refusals: Mutex::default(),
        }
    }

    /// Which replica of `role` refused the last probe, and why. Nothing if that probe was not refused, or if no replica
    /// of the role is alive.
    pub fn refusal(&self, role: &str) -> Option<(String, Reject)> {
        locked(&self.refusals).get(role).filter(|_| !self.peers.alive(role).is_empty()).cloned()
    }

    fn note_refused(&self, error: &AskError) {
        if matches!(error, AskError::Malformed(_)) {
            self.refused.add(&["malformed"]);
        }
    }

    /// Completes when a probe has come back since this was called: a replica may be ready.
    pub fn probed(&self) -> impl Future<Output = ()> + Send {
        self.probed.notified()
    }

    /// What is known of the replicas.
    pub fn replicas(&self) -> MutexGuard<'_, Replicas> {
        locked(&self.replicas)
    }

    /// What the stages of a cycle usually take.
    pub fn stages(&self) -> MutexGuard<'_, StageTimes> {
        locked(&self.stages)
    }

    /// Forgets every replica: for another mission none is prepared, and none has refused it.
    pub fn clear(&self) {
        *self.replicas() = Replicas::default();
        locked(&self.refusals).clear();
    }

    /// Asks `first`, another replica each time one fails, and one more when the answer is late, until an answer is
    /// usable. Gives nothing if the pool's time ends first or no replica is left to ask. The pool's time is the first
    /// half of the budget, and an answer is late after a quarter of the budget.
    ///
    /// To be late is no failure by itself, because all replicas may be slow. A replica has failed if one that was asked
    /// after it answers first. When the pool's time ends, all that have not answered have failed.
    pub(crate) async fn first_answer<T, F>(
        &self,
        role: &str,
        first: String,
        budget: Budget,
        ask: impl Fn(String, Duration) -> F + Sync,
    ) -> Option<T>
    where
        T: Send,
        F: Future<Output = Result<Answer<T>, AskError>> + Send,
    {
        let now = self.peers.now();
        self.replicas().count_question(role);
        let mut late = pin!(self.peers.sleep(budget.until(0.25, now)));
        let mut end = pin!(self.peers.sleep(budget.until(0.5, now)));
        let mut asked: Vec<String> = Vec::new();
        let mut waited_for: Vec<String> = Vec::new();
        let mut open = FuturesUnordered::new();
        let mut next = Some(first);
        let mut is_late = false;
        loop {
            if let Some(instance) = next.take() {
                asked.push(instance.clone());
                waited_for.push(instance.clone());
                open.push(self.question(role, instance, budget.until(0.5, self.peers.now()), &ask));
            }
            tokio::select! {
                biased;
                answer = open.next() => match answer {
                    Some((instance, Ok(value))) => {
                        let overtaken = waited_for.iter().take_while(|other| **other != instance);
                        overtaken.for_each(|other| self.blame_late(role, other, budget));
                        return Some(value);
                    }
                    Some((instance, Err(error))) => {
                        tracing::warn!(role, instance, %error, "no usable answer");
                        let failure = failure(&error);
                        self.hold_against(role, &instance, failure, budget);
                        waited_for.retain(|other| *other != instance);
                        // Where one replica has too much to do, to ask each of the others would make it worse. In
                        // lockstep there is time to ask them all.
                        let is_limited = failure == Failure::Overloaded && budget.clock != Clock::Lockstep;
                        next = self.spare(role, &asked, is_limited);
                    }
                    None => return None,
                },
                () = &mut late, if !is_late => {
                    is_late = true;
                    next = self.spare(role, &asked, true);
                }
                () = &mut end => {
                    waited_for.iter().for_each(|instance| self.blame_late(role, instance, budget));
                    return None;
                }
            }
        }
    }

    /// Another ready replica for a question that those in `asked` have not answered. If it `is_limited`, this is one of
    /// the few questions that may be asked twice ([`Replicas::may_ask_twice`]).
    fn spare(&self, role: &str, asked: &[String], is_limited: bool) -> Option<String> {
        let mut replicas = self.replicas();
        let spare = replicas.spare(role, asked)?;
        (!is_limited || replicas.may_ask_twice(role)).then_some(spare)
    }

    /// Counts it as a failure of a replica that it has not answered in time.
    fn blame_late(&self, role: &str, instance: &str, budget: Budget) {
        tracing::warn!(role, instance, "no answer in time");
        self.hold_against(role, instance, Failure::Broken, budget);
    }

    fn hold_against(&self, role: &str, instance: &str, failure: Failure, budget: Budget) {
        self.failures.add(&[role, failure.name()]);
        self.replicas().failed(role, instance, failure, self.peers.now(), budget.clock);
        self.failed.notify_one();
    }

    /// One question to one replica.
    async fn question<T, F>(
        &self,
        role: &str,
        instance: String,
        timeout: Duration,
        ask: &(impl Fn(String, Duration) -> F + Sync),
    ) -> (String, Result<T, AskError>)
    where
        F: Future<Output = Result<Answer<T>, AskError>> + Send,
    {
        let sent = self.peers.now();
        let outcome = ask(instance.clone(), timeout).await;
        match &outcome {
            Ok(answer) => {
                // No replica can have been busy for longer than the answer took.
                let busy = answer.busy.min(self.peers.now().saturating_sub(sent));
                self.replicas().answered(role, &instance, answer.count, busy);
            }
            Err(error) => self.note_refused(error),
        }
        (instance, outcome.map(|answer| answer.value))
    }

    /// Follows which replicas come and go, and probes each unready one with an empty request until it answers: then
    /// it is alive and prepared. Goes on until it is dropped.
    pub async fn keep_ready(&self, context: &PlanContext) {
        let roles: Vec<&str> = context.pool_roles().collect();
        let robot = &context.mission.order.robot;
        self.peers.follow(&roles);
        let mut probes = FuturesUnordered::new();
        loop {
            let now = self.peers.now();
            for role in &roles {
                let alive = self.peers.alive(role);
                let wanted = Wanted { robot, count: context.replicas_wanted(role) };
                self.replicas().update(role, &alive, wanted, now);
            }
            let due = self.replicas().take_due(now);
            probes.extend(due.into_iter().map(|probe| self.probe(context, probe)));
            let due = self.replicas().next_due();
            let wait = due.map_or(Duration::from_secs(3600), |at| at.saturating_sub(now));
            tokio::select! {
                biased;
                Some((probe, slots)) = probes.next(), if !probes.is_empty() => {
                    let (Probe { role, instance }, now) = (&probe, self.peers.now());
                    match slots {
                        Err(error) if failure(&error) == Failure::Overloaded => {
                            self.replicas().put_off(role, instance, now);
                        }
                        slots => self.replicas().probed(role, instance, slots.ok(), now),
                    }
                    self.probed.notify_waiters();
                }
                () = self.peers.membership_changed() => {}
                () = self.failed.notified() => {}
                () = self.peers.sleep(wait) => {}
            }
        }
    }

    async fn probe(&self, context: &PlanContext, probe: Probe) -> (Probe, Result<u32, AskError>) {
        self.probes.add(&[&probe.role]);
        let slots = self.slots(context, &probe).await;
        match &slots {
            Ok(_) => tracing::info!(role = probe.role, instance = probe.instance, "replica ready"),
            Err(error) => {
                self.note_refused(error);
                tracing::debug!(role = probe.role, instance = probe.instance, %error, "replica not ready");
            }
        }
        match &slots {
            Err(AskError::Rejected(reject)) => {
                locked(&self.refusals).insert(probe.role.clone(), (probe.instance.clone(), reject.clone()));
            }
            _ => {
                locked(&self.refusals).remove(&probe.role);
            }
        }
        (probe, slots)
    }

    async fn slots(&self, context: &PlanContext, probe: &Probe) -> Result<u32, AskError> {
        let order = &context.mission.order;
        let instance = probe.instance.as_str();
        let timeout = PROBE_TIMEOUT;
        let call = Call { instance, robot: &order.robot, timeout, clock: order.clock };
        if keys::generates(&probe.role) {
            return self.peers.generate(call, &context.warm_up_generator()).await.map(|_| 1);
        }
        let warm_up = context.warm_up();
        let scores = self.peers.evaluate(&probe.role, call, &warm_up.shard(&probe.role, 0, 0..0)).await?;
        Ok(scores.slots)
    }
}

fn failure(error: &AskError) -> Failure {
    match error {
        AskError::Rejected(reject) if reject.why == Refusal::Overloaded => Failure::Overloaded,
        AskError::Rejected(Reject { why: Refusal::Cold { .. } | Refusal::NoMap { .. }, .. }) => Failure::Cold,
        _ => Failure::Broken,
    }
}

#[cfg(test)]
mod tests {
    use curionav_schemas::{GenerateReply, Scores};

    use super::*;
    use crate::question::{EvaluateQuestion, GenerateQuestion};

    /// One of every role is there and answers nothing.
    struct Alive;

    impl Peers for Alive {
        fn now(&self) -> Duration {
            Duration::ZERO
        }

        async fn sleep(&self, _: Duration) {}

        fn compute<R>(&self, work: impl FnOnce() -> R) -> R {
            work()
        }

        fn follow(&self, _: &[&str]) {}

        fn alive(&self, _: &str) -> Vec<String> {
            vec!["a".into()]
        }

        async fn membership_changed(&self) {}

        async fn generate(&self, _: Call<'_>, _: &GenerateQuestion<'_>) -> Result<GenerateReply, AskError> {
            Err(AskError::NoReply)
        }

        async fn evaluate(&self, _: &str, _: Call<'_>, _: &EvaluateQuestion<'_>) -> Result<Scores, AskError> {
            Err(AskError::NoReply)
        }
    }

    #[test]
    fn what_was_refused_for_one_mission_is_not_held_against_the_next() {
        let pool = Pool::new(Arc::new(Alive));
        let refused = ("a".to_owned(), Refusal::NotPositive { found: 0.0 }.at("params"));
        locked(&pool.refusals).insert("comfort".into(), refused.clone());
        assert_eq!(pool.refusal("comfort"), Some(refused));
        pool.clear();
        assert_eq!(pool.refusal("comfort"), None);
    }
}
