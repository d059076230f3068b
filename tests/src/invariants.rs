//! What must hold whatever fails, as far as it can be seen from outside: from decisions, reports, commands and how far
//! the robot moves. `faults`, `network` and `soak` feed one [`Checker`] per robot and add what they alone can see.

use std::collections::{BTreeMap, VecDeque};
use std::sync::Arc;

use curionav_planning::arbitration::{Scores, total_costs};
use curionav_planning::occupancy::StaticMap;
use curionav_pool::context::PlanContext;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_schemas::{Action, CycleReport, Decision, Evaluated, Twist};

// The invariants by number and name.
pub(crate) const WITHIN_HORIZON: &str = "1, no command follows a decision past its horizon";
pub(crate) const SCORED: &str = "2, only what every term has scored is followed";
pub(crate) const OWN_SCENE: &str = "3, scores count for their own scene only";
pub(crate) const RISING: &str = "4, the numbers of an arbiter's decisions rise";
pub(crate) const HEALED: &str = "5, all is well soon after nothing fails any more";
pub(crate) const SAME_DECISIONS: &str = "6, replicas change no decision";
pub(crate) const CONTROLLED: &str = "7, under control or soon standing";
pub(crate) const BOUNDED: &str = "8, nothing grows without bound";

/// Longest that a decision may be followed (`hold.max_age` of the profile), seconds.
const HORIZON: f64 = 1.2;
/// Metres that a robot may go without control: to standstill from 1 m/s at 0.5 m/s2, and 0.3 s before.
pub(crate) const UNCONTROLLED_MAX: f64 = 1.0 + 0.3;
/// Violations that are kept: later ones mostly follow from these.
const KEPT: usize = 20;
/// Moves that a violation of control tells of: from 1 m/s to standstill, and what came before.
const MOVES: usize = 35;

/// What was found wrong, the first of it.
#[derive(Debug, Default)]
pub(crate) struct Violations {
    /// Which robot or seed it concerns.
    whose: String,
    found: Vec<String>,
}

impl Violations {
    /// None yet, of `whose`.
    pub(crate) fn of(whose: impl Into<String>) -> Self {
        Self { whose: whose.into(), found: Vec::new() }
    }

    /// Notes a violation of `invariant` unless it `holds`, and prints it at once.
    pub(crate) fn check(&mut self, holds: bool, invariant: &str, what: impl FnOnce() -> String) {
        if !holds && self.found.len() < KEPT {
            let line = format!("{}, invariant {invariant}: {}", self.whose, what());
            eprintln!("{line}");
            self.found.push(line);
        }
    }

    /// Fails if there are any.
    #[track_caller]
    pub(crate) fn assert_none(&self) {
        assert!(self.found.is_empty(), "{:#?}", self.found);
    }
}

/// Checks what one robot does.
#[derive(Default)]
pub(crate) struct Checker {
    /// The missions that the robot may be on, of the same profile.
    contexts: Vec<Arc<PlanContext>>,
    /// Metres beyond [`UNCONTROLLED_MAX`] that are allowed where less is known or the machine is slow.
    slack: f64,
    /// Stamp and validity of each decision, seconds. All are kept: half an hour at 10 Hz takes a megabyte.
    decisions: BTreeMap<(u64, u64), (f64, f64)>,
    obeyed: (u64, u64),
    uncontrolled: f64,
    moves: VecDeque<String>,
    /// Commands that follow a decision, and how many of these decisions were not seen.
    pub(crate) followed: u64,
    pub(crate) unseen: u64,
    /// Greatest distance without control, metres.
    pub(crate) uncontrolled_most: f64,
    pub(crate) violations: Violations,
}

impl Checker {
    /// A robot on one of these missions that may go `slack` metres further without control.
    pub(crate) fn new(whose: impl Into<String>, contexts: Vec<Arc<PlanContext>>, slack: f64) -> Self {
        Self { contexts, slack, violations: Violations::of(whose), ..Self::default() }
    }

    /// A decision that an arbiter of this robot has made.
    pub(crate) fn decided(&mut self, decision: &Decision) {
        let mut terms = self.contexts[0].course.profile.active_terms(decision.uncertain);
        let is_scored = |term| decision.evaluated.get(term).is_some_and(|how| *how != Evaluated::None);
        let scored = terms.all(|(term, _)| is_scored(term));
        let holds = decision.action != Action::Follow || scored;
        self.violations.check(holds, SCORED, || format!("{decision:?}"));
        let id = (decision.epoch, decision.seq);
        self.decisions.insert(id, (decision.stamp, decision.valid_for_s));
    }

    /// The report of a cycle of this robot.
    pub(crate) fn reported(&mut self, report: &CycleReport) {
        let (decision, scene, context) = (&report.decision, &report.scene, &self.contexts[0]);
        let here = report.robot == context.mission.order.robot
            && (decision.tick, decision.stamp, decision.uncertain)
                == (scene.tick, scene.stamp, scene.uncertain);
        self.violations.check(here, OWN_SCENE, || format!("robot {}: {decision:?}", report.robot));
        let (count, generation) = (report.candidates.count, &context.course.profile.generation);
        let of_one_tree = match context.course.profile.generator.as_str() {
            "rrt-star" => generation.candidates.max_candidates,
            "risk-rrt" | "bi-risk-rrt" => generation.risk_rrt.max_candidates,
            "transient-goal" => generation.transient_goal.offers,
            "mppi" => generation.mppi.offers,
            "dwa" => generation.dwa.offers,
            "hrvo-robot" => generation.hrvo_robot.offers,
            other => unreachable!("no bound is known for the generator {other}"),
        };
        self.violations.check(count <= context.course.profile.trees * of_one_tree, BOUNDED, || {
            format!("{count} candidates")
        });
        if decision.action != Action::Follow {
            return;
        }
        let index = report.chosen.expect("a followed candidate is in its report") as usize;
        let found = report.total_of(index);
        let mut true_costs = Vec::new();
        // The cost computed anew is the cost found, bit for bit.
        let agrees = self.contexts.iter().any(|context| {
            true_costs.push(true_cost(context, report, index));
            Some(true_costs[true_costs.len() - 1].0) == found
        });
        self.violations.check(agrees, OWN_SCENE, || {
            format!("cost {found:?} instead of one of {true_costs:?} in cycle {}", decision.seq)
        });
    }

    /// A command of the driver, after the decision that it obeys; gives the stamp of the decision that it follows.
    pub(crate) fn commanded(&mut self, command: &Twist) -> Option<f64> {
        let id = (command.epoch, command.seq);
        let before = std::mem::replace(&mut self.obeyed, id);
        // After the last number there is, which a stranger has given, those of the arbiter itself come again.
        let rises = id.0 != before.0 || id.1 >= before.1 || before.1 == u64::MAX;
        self.violations.check(rises, RISING, || format!("{id:?} after {before:?}"));
        if !command.reason.follows() {
            return None;
        }
        self.followed += 1;
        let Some((stamp, valid_for)) = self.decisions.get(&id).copied() else {
            self.unseen += 1;
            return None;
        };
        let age = command.stamp - stamp;
        let in_time = age <= valid_for.min(HORIZON) + 1e-9;
        self.violations.check(in_time, WITHIN_HORIZON, || format!("{age:.2} s old: {command:?}"));
        Some(stamp)
    }

    /// The driver was started anew, and has forgotten what it obeyed.
    pub(crate) fn driver_restarted(&mut self) {
        self.obeyed = (0, 0);
    }

    /// By `now` the robot has gone so many metres and drives at `v`, on `command` if that still controls it.
    pub(crate) fn moved(&mut self, now: f64, metres: f64, v: f64, command: Option<&Twist>) {
        let follows = command.is_some_and(|c| c.reason.follows());
        self.uncontrolled = if follows || v == 0.0 { 0.0 } else { self.uncontrolled + metres };
        self.uncontrolled_most = self.uncontrolled_most.max(self.uncontrolled);
        let told = command.map(|c| (c.v, c.reason));
        self.moves.push_back(format!("{metres:.3} m to {now:.1} s, {v:.2} m/s, told {told:?}"));
        if self.moves.len() > MOVES {
            self.moves.pop_front();
        }
        let (far, moves) = (self.uncontrolled, &self.moves);
        self.violations
            .check(far <= UNCONTROLLED_MAX + self.slack, CONTROLLED, || format!("{far:.2} m: {moves:#?}"));
    }

    /// Whether enough decisions were seen: a command that follows an unseen one was not checked.
    pub(crate) fn has_seen_enough(&self) -> bool {
        self.unseen <= self.followed / 10
    }
}

/// What a candidate costs in the scene of its report, whole and by term, computed anew.
fn true_cost(context: &PlanContext, report: &CycleReport, index: usize) -> (f64, Vec<f64>) {
    let scene = convert::scene(&report.scene);
    let obstructed = (!scene.obstacles.is_empty()).then(|| {
        let fields = Fields::of_maps([StaticMap::clone(&context.course.map)]);
        context.obstructed(&scene.obstacles, scene.belief.pose.position(), &fields).unwrap()
    });
    let context = obstructed.as_ref().unwrap_or(context);
    let candidate = convert::candidates(report.candidates.clone()).unwrap().pick([index]);
    let mut scores = Scores::new(1);
    for (term, _) in context.course.profile.active_terms(scene.uncertain) {
        let cost = match context.course.evaluator(term) {
            Some(evaluator) => evaluator.evaluate(&scene, &candidate, &|| false).unwrap(),
            // A term that is not built in cannot be computed anew here.
            None => vec![report.terms.iter().find(|t| t.term == term).unwrap().raw_of(index).unwrap()],
        };
        scores.insert(term, 0, &cost).unwrap();
    }
    let totals = total_costs(&context.course.profile, &scene, candidate.steps(), &scores);
    let by_term = totals.terms.iter().map(|term| term.cost[0].unwrap()).collect();
    (totals.total[0].unwrap(), by_term)
}

#[cfg(test)]
mod tests {
    use curionav_schemas::{Clock, CommandReason};
    use curionav_testing::golden;

    use super::*;
    use crate::faults::corridor_map;

    /// What is found wrong with what `tell` says.
    fn found(tell: impl Fn(&mut Checker)) -> Vec<String> {
        let (fields, map) = corridor_map::fields();
        let mission = corridor_map::mission(map, 1000, Clock::Realtime, 1);
        let context = PlanContext::new(mission, &fields, true).unwrap();
        let mut checker = Checker::new("test", vec![Arc::new(context)], 0.0);
        // These are as they should be.
        checker.decided(&golden::decision());
        assert_eq!(checker.commanded(&golden::twist()), Some(golden::decision().stamp));
        checker.moved(4.2, 0.1, 1.0, Some(&golden::twist()));
        tell(&mut checker);
        checker.violations.found
    }

    fn stopped() -> CycleReport {
        let decision = Decision { action: Action::Stop, ..golden::decision() };
        CycleReport { decision, ..golden::cycle_report() }
    }

    #[test]
    fn what_holds_is_no_violation() {
        assert!(found(|checker| checker.driver_restarted()).is_empty());
        assert!(found(|checker| checker.moved(4.3, UNCONTROLLED_MAX, 1.0, None)).is_empty());
    }

    #[test]
    fn each_violation_is_found_under_its_name() {
        let unscored = || Decision { evaluated: BTreeMap::new(), ..golden::decision() };
        let older = || Twist { seq: 13, reason: CommandReason::ToldToStop, ..golden::twist() };
        let late = || Twist { stamp: golden::decision().stamp + HORIZON + 0.1, ..golden::twist() };
        let of_another = || CycleReport { robot: "another".into(), ..stopped() };
        let many = || {
            let mut report = stopped();
            report.candidates.count = 10_000;
            report
        };
        for (name, found) in [
            (SCORED, found(|checker| checker.decided(&unscored()))),
            (RISING, found(|checker| assert!(checker.commanded(&older()).is_none()))),
            (WITHIN_HORIZON, found(|checker| assert!(checker.commanded(&late()).is_some()))),
            (OWN_SCENE, found(|checker| checker.reported(&of_another()))),
            (BOUNDED, found(|checker| checker.reported(&many()))),
            (CONTROLLED, found(|checker| checker.moved(4.3, UNCONTROLLED_MAX + 0.01, 1.0, None))),
        ] {
            assert!(found.iter().any(|line| line.contains(name)), "{name}: {found:?}");
        }
    }
}
