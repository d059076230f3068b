//! What must hold whatever fails, as it is seen from outside: from decisions, reports and commands.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use curionav_pool::context::PlanContext;
use curionav_schemas::{Action, CommandReason, CycleReport, Decision, Evaluated, Twist};

use crate::faults::invariants::{HORIZON, UNCONTROLLED_MAX, true_cost};

/// How long it takes on a machine that has the time until everybody has seen that something is back, and planned
/// five times since: a link is found again within 0.4 s, a replica that did not answer is asked again after 0.2 s
/// and waited for for 0.8 s, and an arbiter prepares.
const SETTLED: Duration = Duration::from_millis(2500);
/// Metres more to a stand where the machine is so busy that commands come two ticks late: the driver brakes by what
/// it has measured and the command it gave last, so the robot then brakes half as hard.
const SLOW_BRAKING: f64 = 1.0;
/// Decisions remembered: longer than any is followed.
const REMEMBERED: usize = 64;
/// A command older than this is none to the base, seconds.
const COMMAND_AGE_MAX: f64 = 0.3;

/// What has been found wrong, the first of it.
#[derive(Clone, Default)]
pub(super) struct Violations(Arc<Mutex<Vec<String>>>);

impl Violations {
    pub(super) fn check(&self, holds: bool, invariant: &str, what: impl FnOnce() -> String) {
        let mut found = self.0.lock().unwrap();
        if !holds && found.len() < 20 {
            let line = format!("{invariant}: {}", what());
            eprintln!("{line}");
            found.push(line);
        }
    }

    pub(super) fn found(&self) -> Vec<String> {
        self.0.lock().unwrap().clone()
    }
}

/// How a robot came back after something was mended.
#[derive(Debug, Clone, Copy)]
pub(super) struct Recovery {
    pub(super) healed: Instant,
    /// Until the first nominal decision.
    pub(super) nominal_after: Option<Duration>,
    /// Until it drove on a decision made since.
    pub(super) driven_after: Option<Duration>,
    /// Decisions made when all should be well, and how many of them were not nominal.
    pub(super) settled: (u64, u64),
}

impl Recovery {
    /// From now on.
    pub(super) fn begun() -> Self {
        Self { healed: Instant::now(), nominal_after: None, driven_after: None, settled: (0, 0) }
    }

    pub(super) fn is_over(&self) -> bool {
        self.nominal_after.is_some() && self.driven_after.is_some()
    }
}

/// What one robot did.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct Counts {
    pub(super) ticks: u64,
    pub(super) decisions: u64,
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

/// One robot, watched.
pub(super) struct Watch {
    name: String,
    /// The missions it may be on: one a goal.
    contexts: Vec<Arc<PlanContext>>,
    violations: Violations,
    /// With when each came.
    decisions: BTreeMap<(u64, u64), (Instant, Decision)>,
    obeyed: (u64, u64),
    commanded_because: Option<CommandReason>,
    uncontrolled: f64,
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
    pub(super) fn new(name: &str, contexts: Vec<Arc<PlanContext>>, violations: Violations) -> Self {
        Self {
            name: name.to_owned(),
            contexts,
            violations,
            decisions: BTreeMap::new(),
            obeyed: (0, 0),
            commanded_because: None,
            uncontrolled: 0.0,
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
        self.recovery = Some(Recovery::begun());
    }

    fn check(&self, holds: bool, invariant: &str, what: impl FnOnce() -> String) {
        self.violations.check(holds, invariant, || format!("{}: {}", self.name, what()));
    }

    /// A decision the arbiter has made.
    pub(super) fn decided(&mut self, decision: Decision) {
        self.counts.decisions += 1;
        self.counts.nominal += u64::from(decision.degraded.is_empty());
        for why in &decision.degraded {
            *self.degraded.entry(why.code()).or_default() += 1;
        }
        let follows = decision.action == Action::Follow;
        self.counts.followed += u64::from(follows);
        if follows {
            self.preparing_since = None;
            let profile = &self.contexts[0].profile;
            let scored = profile
                .active_terms(decision.uncertain)
                .all(|(m, _)| decision.evaluated.get(m).is_some_and(|how| *how != Evaluated::None));
            self.check(scored, "2, only what every metric has scored is followed", || {
                format!("{decision:?}")
            });
        }
        self.recover(decision.degraded.is_empty());
        self.decisions.insert((decision.epoch, decision.seq), (Instant::now(), decision));
        while self.decisions.len() > REMEMBERED {
            self.decisions.pop_first();
        }
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

    /// The account of a cycle.
    pub(super) fn reported(&mut self, report: &CycleReport) {
        self.counts.reports += 1;
        let decision = &report.decision;
        self.check(report.robot == self.name, "4, nobody is told what is meant for another", || {
            format!("a report of {}", report.robot)
        });
        let of_scene = (decision.tick, decision.stamp) == (report.scene.tick, report.scene.stamp);
        self.check(of_scene, "3, scores count for their own scene only", || format!("{decision:?}"));
        let most = self.contexts[0].profile.max_candidates();
        self.check(report.candidates.count <= most, "8, nothing grows without bound", || "candidates".into());
        let Some(index) = report.chosen.filter(|_| decision.action == Action::Follow) else { return };
        let index = index as usize;
        let terms: Vec<&str> =
            self.contexts[0].profile.active_terms(report.scene.uncertain).map(|t| t.0).collect();
        let costs: Vec<f64> =
            self.contexts.iter().map(|context| true_cost(context, report, index, &terms).0).collect();
        let found = report.total_of(index).unwrap();
        self.check(costs.contains(&found), "3, scores count for their own scene only", || {
            format!("cost {found} instead of one of {costs:?}, cycle {}", decision.seq)
        });
    }

    /// A command the driver has given.
    pub(super) fn commanded(&mut self, command: &Twist) {
        self.counts.commands += 1;
        let id = (command.epoch, command.seq);
        self.check(id >= self.obeyed, "4, (epoch, seq) rises", || format!("{id:?} after {:?}", self.obeyed));
        self.obeyed = id;
        self.commanded_because = Some(command.reason);
        if !command.reason.follows() {
            return;
        }
        self.followed_gap = self.followed_gap.max(self.followed_at.elapsed().as_secs_f64());
        self.followed_at = Instant::now();
        let Some((came, decision)) = self.decisions.get(&id) else {
            self.counts.unseen += 1;
            return;
        };
        if let Some(recovery) =
            self.recovery.as_mut().filter(|r| r.driven_after.is_none() && *came > r.healed)
        {
            recovery.driven_after = Some(recovery.healed.elapsed());
        }
        let age = command.stamp - decision.stamp;
        let in_time = age <= decision.valid_for_s.min(HORIZON) + 1e-9;
        self.check(in_time, "1, no command from a decision past its horizon", || format!("{age:.2} s old"));
    }

    /// What it decided and was commanded last, for whoever asks why it stands.
    pub(super) fn last_words(&self) -> String {
        let decision = self.decisions.last_key_value().map(|(id, (came, d))| {
            let (ago, degraded) = (came.elapsed(), &d.degraded);
            format!("decision {id:?} {ago:.1?} ago, {:?}: {:?} {degraded:?}", d.action, d.reason)
        });
        let commanded = format!("obeys {:?}, {:?}", self.obeyed, self.commanded_because);
        format!("{}; {commanded}", decision.unwrap_or_else(|| "no decision".to_owned()))
    }

    /// After a tick: how far the robot went on which command, and where it stands.
    pub(super) fn rolled(&mut self, now: f64, metres: f64, v: f64, command: Option<&Twist>) {
        self.counts.ticks += 1;
        self.counts.metres += metres;
        let controlled =
            command.is_some_and(|c| now - c.stamp <= COMMAND_AGE_MAX + 1e-9 && c.reason.follows());
        self.uncontrolled = if controlled || v == 0.0 { 0.0 } else { self.uncontrolled + metres };
        self.counts.uncontrolled = self.counts.uncontrolled.max(self.uncontrolled);
        let far = self.uncontrolled;
        let most = UNCONTROLLED_MAX + SLOW_BRAKING;
        self.check(far <= most, "7, under control or soon standing", || format!("{far:.2} m at {now:.1} s"));
    }
}
