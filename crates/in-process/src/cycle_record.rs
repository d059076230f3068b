//! How the cycles of a run went: whether they were decided in time, and what they had to do without.

use std::collections::{BTreeMap, BTreeSet};
use std::time::Duration;

use curionav_mission::latency::percentile_ms;
use curionav_schemas::limits::MAX_TRACE_ROWS;
use curionav_schemas::{Cycles, Decision, Degradation, Reason};

/// Collects the cycles of one run.
#[derive(Debug)]
pub(crate) struct CycleRecord {
    /// Ticks between two cycles.
    period: u64,
    /// The next tick that is to be planned in.
    due: u64,
    skipped: u64,
    late: u64,
    first_choice: u64,
    other_choice: BTreeMap<String, u64>,
    degraded: u64,
    degraded_by: BTreeMap<String, u64>,
    /// How long each cycle took.
    times: Vec<Duration>,
}

impl CycleRecord {
    /// No cycle yet; from tick 0 on one is due every `plan_every` ticks.
    pub(crate) fn new(plan_every: u32) -> Self {
        Self {
            period: u64::from(plan_every.max(1)),
            due: 0,
            skipped: 0,
            late: 0,
            first_choice: 0,
            other_choice: BTreeMap::new(),
            degraded: 0,
            degraded_by: BTreeMap::new(),
            times: Vec::new(),
        }
    }

    /// A decision has come, while the world was at `tick`.
    pub(crate) fn decided(&mut self, decision: &Decision, tick: u64) {
        let next = decision.tick.saturating_add(self.period);
        self.skipped = self.skipped.saturating_add(decision.tick.saturating_sub(self.due) / self.period);
        self.due = self.due.max(next);
        self.late += u64::from(tick > next);
        if decision.reason == Reason::LeastCost {
            self.first_choice += 1;
        } else {
            *self.other_choice.entry(decision.reason.code().to_owned()).or_default() += 1;
        }
        self.degraded += u64::from(!decision.degraded.is_empty());
        for code in decision.degraded.iter().map(Degradation::code).collect::<BTreeSet<_>>() {
            *self.degraded_by.entry(code.to_owned()).or_default() += 1;
        }
        // Whatever else decides, the longest run has no more cycles.
        if self.times.len() < MAX_TRACE_ROWS {
            self.times.push(Duration::from_micros(decision.elapsed_us));
        }
    }

    /// What they came to, in a run that ends at `tick`.
    pub(crate) fn finish(mut self, tick: u64) -> Cycles {
        Cycles {
            count: self.times.len() as u64,
            skipped: self.skipped.saturating_add(tick.saturating_sub(self.due) / self.period),
            late: self.late,
            first_choice: self.first_choice,
            other_choice: self.other_choice,
            degraded: self.degraded,
            degraded_by: self.degraded_by,
            p50_ms: percentile_ms(&mut self.times, 0.50),
            p99_ms: percentile_ms(&mut self.times, 0.99),
            max_ms: percentile_ms(&mut self.times, 1.0),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_schemas::PreviousState;
    use curionav_testing::golden;

    /// Cycles of these ticks that were decided so many ticks later, in a run that ends at `end`.
    fn cycles(plan_every: u32, decided: &[(u64, u64)], end: u64) -> Cycles {
        let mut record = CycleRecord::new(plan_every);
        for (tick, after) in decided {
            record.decided(&Decision { tick: *tick, ..golden::decision() }, tick + after);
        }
        record.finish(end)
    }

    #[test]
    fn a_tick_that_is_due_and_has_no_decision_is_skipped_also_at_both_ends() {
        let skipped = |decided: &[u64], end: u64| {
            let at_once: Vec<_> = decided.iter().map(|tick| (*tick, 0)).collect();
            cycles(3, &at_once, end).skipped
        };
        // The tick of the end is still under way in real time.
        assert_eq!(skipped(&[0, 3, 6], 9), 0);
        assert_eq!(skipped(&[0, 9, 12], 15), 2);
        assert_eq!(skipped(&[6, 9], 18), 4);
        assert_eq!(skipped(&[], 9), 3);
    }

    #[test]
    fn a_decision_that_comes_after_the_next_cycle_was_due_is_late() {
        let Cycles { count, skipped, late, .. } = cycles(1, &[(0, 1), (1, 2), (3, 1)], 4);
        assert_eq!((count, skipped, late), (3, 1, 1));
        assert_eq!(cycles(3, &[(0, 3), (3, 4)], 6).late, 1);
    }

    #[test]
    fn the_first_choice_is_what_the_planner_wanted_most_and_every_other_cycle_has_its_reason() {
        let mut record = CycleRecord::new(1);
        let none_free = Reason::NoneFree { previous: PreviousState::Absent };
        let others = [Reason::LeastCostFree, Reason::OnlySlowFree, Reason::LeastCostFree, none_free];
        for reason in [Reason::LeastCost, Reason::LeastCost].into_iter().chain(others) {
            record.decided(&Decision { reason, ..golden::decision() }, 0);
        }
        let Cycles { count, first_choice, other_choice, .. } = record.finish(0);
        let expected = [("least_cost_free", 2), ("none_free", 1), ("only_slow_free", 1)];
        let expected = expected.map(|(code, cycles)| (code.to_owned(), cycles));
        assert_eq!((count, first_choice, other_choice), (6, 2, expected.into()));
    }

    #[test]
    fn a_cycle_counts_once_for_each_code_of_its_list() {
        let locally = |term: &str| Degradation::EvaluatedLocally { term: term.into() };
        let mut record = CycleRecord::new(1);
        let both = vec![locally("cpc"), locally("cnc"), Degradation::CutShort];
        for degraded in [both, vec![Degradation::CutShort], Vec::new()] {
            record.decided(&Decision { degraded, ..golden::decision() }, 0);
        }
        let Cycles { count, degraded, degraded_by, .. } = record.finish(0);
        let expected = [("cut_short".to_owned(), 2), ("evaluated_locally".to_owned(), 1)];
        assert_eq!((count, degraded, degraded_by), (3, 2, expected.into()));
    }
}
