//! One robot, watched while it runs: what it did, how it came back from faults, and whether the invariants hold.

use std::collections::BTreeMap;
use std::iter::Sum;
use std::sync::Arc;
use std::time::{Duration, Instant};

use curionav_pool::context::PlanContext;
use curionav_schemas::{Action, CommandReason, CycleReport, Decision, Twist};

use crate::invariants::{Checker, Violations};
use crate::pace::Pace;

/// How long it takes on a machine that has the time until every process has seen that something is back, and planned
/// five times since: a link is found again within 0.4 s, a replica that did not answer is asked again after 0.2 s
/// and waited for for 0.8 s, and an arbiter prepares.
const SETTLED: Duration = Duration::from_millis(2500);
/// Metres more to standstill in the short form, where the machine may be so busy that commands come two ticks late: the
/// driver brakes by what it has measured and the command it gave last, so the robot then brakes half as hard.
const SLOW_BRAKING: f64 = 1.0;
/// A command older than this is none to the base, seconds.
const COMMAND_AGE_MAX: f64 = 0.3;

/// How robots drive.
#[derive(Debug, Clone, Copy)]
pub(super) struct Drive {
    pub(super) pace: Pace,
    /// In a long run, which is on a machine with the time for it.
    pub(super) is_long: bool,
}

/// How a robot came back after something was mended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Recovery {
    healed: Instant,
    /// The same by the robot's clock, seconds.
    stamp: f64,
    /// Until the first nominal decision.
    pub(super) nominal_after: Option<Duration>,
    /// Until it drove on a decision made since.
    pub(super) driven_after: Option<Duration>,
    /// Decisions made when all should be well, and how many of them were not nominal.
    pub(super) settled: (u64, u64),
}

impl Recovery {
    pub(super) fn is_over(&self) -> bool {
        self.nominal_after.is_some() && self.driven_after.is_some()
    }
}

/// What one robot did.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub(super) ticks: u64,
    pub(super) decisions: u64,
    /// Decisions that took longer than the time between two ticks.
    pub(super) late: u64,
    pub(super) nominal: u64,
    pub(super) followed: u64,
    pub(super) reports: u64,
    pub(super) commands: u64,
    /// Commands from decisions that were not seen here.
    pub(super) unseen: u64,
    pub(super) metres: f64,
    pub(super) goals: u64,
    /// Greatest distance out of control, metres.
    pub(super) uncontrolled: f64,
}

impl Sum for Counts {
    fn sum<I: Iterator<Item = Self>>(all: I) -> Self {
        all.fold(Self::default(), |a, b| Self {
            ticks: a.ticks + b.ticks,
            decisions: a.decisions + b.decisions,
            late: a.late + b.late,
            nominal: a.nominal + b.nominal,
            followed: a.followed + b.followed,
            reports: a.reports + b.reports,
            commands: a.commands + b.commands,
            unseen: a.unseen + b.unseen,
            metres: a.metres + b.metres,
            goals: a.goals + b.goals,
            uncontrolled: a.uncontrolled.max(b.uncontrolled),
        })
    }
}

/// One robot, watched.
pub(super) struct Watch {
    checker: Checker,
    /// Between two ticks.
    period: Duration,
    decided: Option<(Instant, Decision)>,
    commanded: Option<(u64, u64, CommandReason)>,
    /// Of the robot's clock, seconds.
    now: f64,
    pub(super) preparing_since: Option<Instant>,
    /// When it last followed a decision, and longest between two times, seconds.
    pub(super) followed_at: Instant,
    pub(super) followed_gap: f64,
    pub(super) counts: Counts,
    /// How often a decision was degraded, by why.
    pub(super) degraded: BTreeMap<&'static str, u64>,
    pub(super) recovery: Option<Recovery>,
}

impl Watch {
    /// Robot `name` on one of these missions.
    pub(super) fn new(name: &str, contexts: Vec<Arc<PlanContext>>, drive: Drive) -> Self {
        let slack = if drive.is_long { 0.0 } else { SLOW_BRAKING };
        Self {
            period: drive.pace.tick(),
            checker: Checker::new(name, contexts, slack),
            decided: None,
            commanded: None,
            now: 0.0,
            preparing_since: None,
            followed_at: Instant::now(),
            followed_gap: 0.0,
            counts: Counts::default(),
            degraded: BTreeMap::new(),
            recovery: None,
        }
    }

    /// Something has been mended: from here on it is to recover.
    pub(super) fn heal(&mut self) {
        let (healed, stamp) = (Instant::now(), self.now);
        self.recovery =
            Some(Recovery { healed, stamp, nominal_after: None, driven_after: None, settled: (0, 0) });
    }

    /// What was found wrong.
    pub(super) fn violations(&mut self) -> &mut Violations {
        &mut self.checker.violations
    }

    /// A decision the arbiter has made.
    pub(super) fn decided(&mut self, decision: Decision) {
        self.checker.decided(&decision);
        self.counts.decisions += 1;
        self.counts.late += u64::from(decision.elapsed_us > self.period.as_micros() as u64);
        self.counts.nominal += u64::from(decision.degraded.is_empty());
        for why in &decision.degraded {
            *self.degraded.entry(why.code()).or_default() += 1;
        }
        if decision.action == Action::Follow {
            self.counts.followed += 1;
            self.preparing_since = None;
        }
        self.recover(decision.degraded.is_empty());
        self.decided = Some((Instant::now(), decision));
    }

    fn recover(&mut self, nominal: bool) {
        let Some(recovery) = &mut self.recovery else { return };
        let passed = recovery.healed.elapsed();
        if passed > SETTLED {
            recovery.settled.0 += 1;
            recovery.settled.1 += u64::from(!nominal);
        }
        if nominal && recovery.nominal_after.is_none() {
            recovery.nominal_after = Some(passed);
        }
    }

    /// The report of a cycle.
    pub(super) fn reported(&mut self, report: &CycleReport) {
        self.checker.reported(report);
        self.counts.reports += 1;
    }

    /// A command the driver has given.
    pub(super) fn commanded(&mut self, command: &Twist) {
        let followed = self.checker.commanded(command);
        self.counts.commands += 1;
        self.counts.unseen = self.checker.unseen;
        self.commanded = Some((command.epoch, command.seq, command.reason));
        if !command.reason.follows() {
            return;
        }
        self.followed_gap = self.followed_gap.max(self.followed_at.elapsed().as_secs_f64());
        self.followed_at = Instant::now();
        let Some(recovery) = &mut self.recovery else { return };
        if recovery.driven_after.is_none() && followed > Some(recovery.stamp) {
            recovery.driven_after = Some(recovery.healed.elapsed());
        }
    }

    /// What it decided and was commanded last, which tells why it stands.
    pub(super) fn last_words(&self) -> String {
        let decided = self.decided.as_ref().map(|(came, d)| {
            let (ago, degraded) = (came.elapsed(), &d.degraded);
            format!(
                "decision ({}, {}) {ago:.1?} ago, {:?}: {:?} {degraded:?}",
                d.epoch, d.seq, d.action, d.reason
            )
        });
        format!("{}; obeys {:?}", decided.unwrap_or_else(|| "no decision".to_owned()), self.commanded)
    }

    /// After a tick: how far the robot went on which command, and how fast it is.
    pub(super) fn rolled(&mut self, now: f64, metres: f64, v: f64, command: Option<&Twist>) {
        self.now = now;
        self.counts.ticks += 1;
        self.counts.metres += metres;
        let controls = command.filter(|c| now - c.stamp <= COMMAND_AGE_MAX + 1e-9);
        self.checker.moved(now, metres, v, controls);
        self.counts.uncontrolled = self.checker.uncontrolled_most;
    }

    /// Fails if anything was not as it must be, or too little was seen to tell.
    pub(super) fn judge(&self) {
        self.checker.violations.assert_none();
        assert!(self.checker.has_seen_enough(), "{:?}", self.counts);
    }
}
