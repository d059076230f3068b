//! What can be seen from outside: decisions, commands, reports and odometry, with the time they arrived.

use std::collections::BTreeSet;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::{Duration, Instant};

use curionav_pool::context::PlanContext;
use curionav_runtime::config::ServiceConfig;
use curionav_runtime::map_store;
use curionav_runtime::membership::Membership;
use curionav_runtime::query::fetch;
use curionav_runtime::session;
use curionav_runtime::topic::Inbox;
use curionav_schemas::{
    Action, CycleReport, Decision, Message, Mission, Odometry, ServiceStatus, Twist, keys,
};
use tempfile::TempDir;
use zenoh::Session;

use super::figures::Figures;
use super::pace::{Kept, Pace};
use crate::end_to_end::program::two_workers;

/// Cycles in a row that make a robot nominal.
const NOMINAL_CYCLES: usize = 10;
/// The recorder's own sleeps; what they last longer, others waited for the processor as well.
const NAP: Duration = Duration::from_millis(5);
/// Stalls worth remembering.
const STALL_MIN: Duration = Duration::from_millis(8);
const FETCH_TIMEOUT: Duration = Duration::from_secs(1);

/// Everything heard, in the order of arrival.
#[derive(Default)]
pub(super) struct Record {
    pub(super) decisions: Vec<(Instant, Decision)>,
    pub(super) commands: Vec<(Instant, Twist)>,
    pub(super) odometry: Vec<(Instant, Odometry)>,
    pub(super) reports: Vec<(Instant, CycleReport)>,
    /// When this process was kept from the processor, and for how long.
    pub(super) stalls: Vec<(Instant, Duration)>,
}

impl Record {
    /// For how long the machine kept anything from the processor since `from`: longest nap of the recorder beyond what
    /// it asked for, longest time by which a tick was late, and what a cycle takes in the median.
    pub(super) fn stall_since(&self, from: Instant, pace: Pace) -> Duration {
        let naps = self.stalls.iter().filter(|(at, _)| *at >= from).map(|(_, stall)| *stall);
        // Nothing holds the simulator up: a tick that comes late was kept from the processor.
        let late = self.odometry.windows(2).filter(|pair| pair[0].0 >= from).map(|pair| {
            let ticks = u32::try_from(pair[1].1.tick.saturating_sub(pair[0].1.tick)).unwrap_or(u32::MAX);
            (pair[1].0 - pair[0].0).saturating_sub(pace.tick().saturating_mul(ticks))
        });
        let mut cycles: Vec<u64> =
            self.decisions.iter().filter(|(at, _)| *at >= from).map(|(_, d)| d.elapsed_us).collect();
        cycles.sort_unstable();
        let usual = cycles.get(cycles.len() / 2).map(|us| Duration::from_micros(*us));
        naps.chain(late).chain(usual).max().unwrap_or_default()
    }

    /// The last cycles, all on time and as they should be.
    pub(super) fn nominal_since(&self, from: Instant, cycles: usize) -> bool {
        let after = self.decisions.iter().rev().take_while(|(at, _)| *at >= from);
        let last: Vec<&Decision> = after.take(cycles).map(|(_, d)| d).collect();
        last.len() == cycles
            && last.iter().all(|d| d.degraded.is_empty() && d.action == Action::Follow)
            && last.windows(2).all(|pair| pair[0].tick == pair[1].tick + 1)
    }
}

/// A client of a router that listens.
pub(super) struct Recorder {
    pub(super) runtime: tokio::runtime::Runtime,
    pub(super) session: Session,
    membership: Membership,
    record: Arc<Mutex<Record>>,
    pace: Pace,
}

impl Recorder {
    /// Listens behind the first of these routers that answers.
    pub(super) fn start(endpoints: &[String], pace: Pace, secure: Option<&TempDir>) -> Self {
        let runtime = two_workers();
        let config = ServiceConfig {
            connect: endpoints.to_vec(),
            secure: secure.map(|folder| folder.path().to_owned()),
            certificates: vec!["viewer".parse().unwrap()],
            ..ServiceConfig::default()
        };
        let session = runtime.block_on(session::client(&config)).unwrap();
        let membership = Membership::follow(&session).unwrap();
        let recorder = Self { runtime, session, membership, record: Arc::default(), pace };
        recorder.keep("decision", |record, at, decision| record.decisions.push((at, decision)));
        recorder.keep("cmd", |record, at, command| record.commands.push((at, command)));
        recorder.keep("odom", |record, at, odometry| record.odometry.push((at, odometry)));
        recorder.keep("report", |record, at, report| record.reports.push((at, report)));
        recorder.watch_stalls();
        recorder
    }

    fn keep<M: Message + Send + 'static>(
        &self,
        stream: &str,
        push: impl Fn(&mut Record, Instant, M) + Send + 'static,
    ) {
        let inbox = Inbox::<M>::new(&self.session, &keys::robot("robot", stream).unwrap()).unwrap();
        let record = Arc::clone(&self.record);
        self.runtime.spawn(async move {
            while let Some(message) = inbox.next().await {
                push(&mut locked(&record), Instant::now(), message);
            }
        });
    }

    fn watch_stalls(&self) {
        let record = Arc::downgrade(&self.record);
        std::thread::spawn(move || {
            loop {
                let begun = Instant::now();
                std::thread::sleep(NAP);
                let Some(record) = record.upgrade() else { return };
                let stall = begun.elapsed() - NAP;
                if stall > STALL_MIN {
                    locked(&record).stalls.push((begun, stall));
                }
            }
        });
    }

    /// What has been heard so far.
    pub(super) fn record(&self) -> MutexGuard<'_, Record> {
        locked(&self.record)
    }

    /// Waits until `condition` holds and gives how long that took since `from`, at most `limit` at 10 Hz.
    pub(super) fn await_until(
        &self,
        what: &str,
        from: Instant,
        limit: Duration,
        mut condition: impl FnMut(&Self) -> bool,
    ) -> Kept<Duration> {
        let limit = self.pace.scaled(limit);
        while !condition(self) {
            if from.elapsed() >= limit {
                let stall = self.record().stall_since(from, self.pace);
                let late = || format!("not within {} s: {what}; {}", limit.as_secs_f64(), self.last());
                return Err(self.pace.excuse(stall, late));
            }
            std::thread::sleep(Duration::from_millis(3));
        }
        Ok(from.elapsed())
    }

    /// Waits until the last cycles were as they should be.
    pub(super) fn await_nominal(&self, what: &str, limit: Duration) -> Kept {
        let from = Instant::now();
        self.await_until(what, from, limit, |r| r.record().nominal_since(from, NOMINAL_CYCLES))?;
        Ok(())
    }

    /// Waits for so many cycles from now on, however they end.
    pub(super) fn await_cycles(&self, cycles: usize) -> Kept {
        let from = Instant::now();
        self.await_until("cycles go on", from, Duration::from_secs(10), |r| {
            r.record().decisions.iter().rev().take_while(|(at, _)| *at > from).count() >= cycles
        })?;
        Ok(())
    }

    /// What all since `from` came to.
    pub(super) fn figures_since(&self, from: Instant) -> Figures {
        Figures::since(&self.record(), from, self.pace)
    }

    /// Whether a replica has announced itself.
    pub(super) fn is_alive(&self, role: &str, instance: &str) -> bool {
        self.membership.of(role).iter().any(|i| i == instance)
    }

    /// What a replica has done since it started: questions a generator has answered, candidates an evaluator has
    /// scored; nothing if it does not say.
    pub(super) fn work(&self, role: &str, instance: &str) -> Option<f64> {
        let key = keys::status(role, instance).unwrap();
        let status = self.runtime.block_on(fetch::<ServiceStatus>(&self.session, &key, FETCH_TIMEOUT));
        let status = status.ok()?;
        if role == "generator" {
            return Some(status.requests as f64);
        }
        let (_, scored) =
            status.metrics.iter().find(|(name, _)| name.starts_with("curionav_candidates_total"))?;
        Some(*scored)
    }

    /// How many replicas of `role` the arbiter gives work; nothing if it does not say.
    pub(super) fn ready(&self, role: &str) -> Option<f64> {
        let key = keys::status("arbiter", "a").unwrap();
        let status =
            self.runtime.block_on(fetch::<ServiceStatus>(&self.session, &key, FETCH_TIMEOUT)).ok()?;
        let pool = format!("pool=\"{role}\"");
        let of_role = |name: &str| name.starts_with("curionav_pool_ready") && name.contains(&pool);
        status.metrics.iter().find(|(name, _)| of_role(name)).map(|(_, ready)| *ready)
    }

    /// The robot's mission.
    pub(super) fn mission(&self) -> Mission {
        let key = keys::robot("robot", "mission").unwrap();
        self.runtime.block_on(fetch(&self.session, &key, FETCH_TIMEOUT)).unwrap()
    }

    /// A mission made ready here as the arbiter has it.
    pub(super) fn context(&self, mission: Mission) -> PlanContext {
        let fields = {
            let _inside = self.runtime.enter();
            map_store::fields(&self.session)
        };
        PlanContext::new(mission, &fields, true).unwrap()
    }

    /// The last cycles in a few words, which tell why.
    pub(super) fn last(&self) -> String {
        let record = self.record();
        let from = record.decisions.len().saturating_sub(15);
        let mut said = String::from("the last cycles:\n");
        for (at, d) in &record.decisions[from..] {
            said += &format!(
                "{:6.2} s ago, tick {}, {:?} ({:?}), {} us, {:?}\n",
                at.elapsed().as_secs_f64(),
                d.tick,
                d.action,
                d.reason,
                d.elapsed_us,
                d.degraded
            );
        }
        for (at, c) in record.commands.iter().rev().take(5) {
            said += &format!("{:6.2} s ago, {:.2} m/s, {:?}\n", at.elapsed().as_secs_f64(), c.v, c.reason);
        }
        for (at, o) in record.odometry.iter().rev().take(5) {
            said +=
                &format!("{:6.2} s ago, tick {}, at {:.2} m/s\n", at.elapsed().as_secs_f64(), o.tick, o.v);
        }
        let instances: BTreeSet<String> = self.membership.all().into_values().flatten().collect();
        said + &format!("alive: {instances:?}")
    }
}

fn locked(record: &Mutex<Record>) -> MutexGuard<'_, Record> {
    record.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Drop for Recorder {
    fn drop(&mut self) {
        session::close(&self.session);
    }
}
