//! What operators count of cycles.

use std::sync::{Arc, Mutex};
use std::time::Duration;

use curionav_runtime::locked::locked;
use curionav_runtime::metrics::{Counter, Durations, Metrics, Tally};
use curionav_schemas::Decision;

use crate::report::CycleOutcome;
use curionav_pool::peers::{Peers, ZenohPeers};
use curionav_pool::pool::Pool;

/// Counts since the start.
#[derive(Debug)]
pub(crate) struct CycleCounts {
    decisions: Tally,
    degraded: Tally,
    evaluations: Tally,
    stages: Durations,
    unplanned: Counter,
    /// Roles the mission asks pools for.
    roles: Arc<Mutex<Vec<String>>>,
}

impl CycleCounts {
    pub(crate) fn new() -> Self {
        Self {
            decisions: Tally::new(&["action"]),
            degraded: Tally::new(&["reason"]),
            evaluations: Tally::new(&["term", "by"]),
            stages: Durations::new(&["stage"]),
            unplanned: Counter::default(),
            roles: Arc::default(),
        }
    }

    /// One more decision, with what it was made from if it was planned.
    pub(crate) fn record(&self, decision: &Decision, outcome: Option<&CycleOutcome>) {
        self.decisions.add(&[decision.action.into()]);
        for reason in &decision.degraded {
            self.degraded.add(&[reason.code()]);
        }
        for (term, by) in &decision.evaluated {
            self.evaluations.add(&[term, by.into()]);
        }
        let Some(CycleOutcome { timings, gap, .. }) = outcome else { return };
        self.unplanned.inc_by(*gap);
        let stage = |stage, us| self.stages.record(stage, Duration::from_micros(us));
        stage("generate", timings.generate_us);
        // Terms are evaluated side by side.
        if let Some(us) = timings.evaluate_us.iter().map(|t| t.us).max() {
            stage("evaluate", us);
        }
        stage("arbitrate", timings.arbitrate_us);
    }

    /// From now on the mission asks pools for these.
    pub(crate) fn follow(&self, roles: impl Iterator<Item = String>) {
        *locked(&self.roles) = roles.collect();
    }

    pub(crate) fn register(&self, metrics: &mut Metrics, pool: &Arc<Pool<ZenohPeers>>) {
        metrics.tally("decisions", "Decisions, by what the robot is told", &self.decisions);
        metrics.tally("degraded", "Decisions made while something was missing, by what", &self.degraded);
        let help = "Decisions in which a term counted, by what scored it";
        metrics.tally("evaluations", help, &self.evaluations);
        metrics.durations("stage_duration_seconds", "Time of each stage of a cycle", &self.stages);
        let help = "Planning ticks without a cycle: skipped, or not planned";
        metrics.count("unplanned_ticks", help, self.unplanned.clone());
        metrics.tally("pool_failures", "Questions to replicas that were of no use", &pool.failures);
        metrics.tally("pool_probes", "Questions whether a replica is ready", &pool.probes);
        metrics.tally("pool_questions", "Questions to replicas, probes included", &pool.peers.questions);
        metrics.tally("pool_sent_bytes", "Bytes of the questions to replicas", &pool.peers.sent);
        metrics.tally("pool_received_bytes", "Bytes of the answers of replicas", &pool.peers.received);
        let pool = Arc::clone(pool);
        let roles = Arc::clone(&self.roles);
        let counted = move |count: fn(&Pool<ZenohPeers>, &str) -> usize| -> Vec<(String, f64)> {
            let roles = locked(&roles).clone();
            roles.into_iter().map(|role| (role.clone(), count(&pool, &role) as f64)).collect()
        };
        let also = counted.clone();
        metrics.gauges("pool_alive", "Replicas alive, of the roles the mission needs", "pool", move || {
            counted(|pool, role| pool.peers.alive(role).len())
        });
        metrics.gauges("pool_ready", "Replicas that are given work", "pool", move || {
            also(|pool, role| pool.replicas().ready(role).len())
        });
    }
}
