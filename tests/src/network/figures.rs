//! What a fault cost, measured, and printed as a line of a table.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use curionav_schemas::Degradation;

use super::pace::Pace;
use super::recorder::Record;

/// From a fault to the end of its consequences.
#[derive(Debug)]
pub(super) struct Figures {
    /// Ticks without a decision of their own.
    pub(super) undecided: usize,
    /// Decisions that were not as they should be.
    pub(super) degraded: usize,
    /// From the fault until liveliness said so.
    pub(super) detected: Option<Duration>,
    /// From the return until everything was as before.
    pub(super) recovered: Option<Duration>,
    /// In which ways.
    pub(super) reasons: BTreeSet<&'static str>,
    /// The longest stall of this machine meanwhile.
    pub(super) stall: Duration,
}

impl Figures {
    /// Of all since `from`.
    pub(super) fn since(record: &Record, from: Instant, pace: Pace) -> Self {
        let decided: BTreeSet<u64> = record.decisions.iter().map(|(_, d)| d.tick).collect();
        let last = decided.last().copied().unwrap_or_default();
        let ticks = record.odometry.iter().filter(|(at, _)| *at >= from).map(|(_, o)| o.tick);
        let after = || record.decisions.iter().filter(|(at, _)| *at >= from).map(|(_, d)| d);
        Self {
            undecided: ticks.filter(|tick| *tick < last && !decided.contains(tick)).count(),
            degraded: after().filter(|d| !d.degraded.is_empty()).count(),
            reasons: after().flat_map(|d| d.degraded.iter().map(Degradation::code)).collect(),
            detected: None,
            recovered: None,
            stall: record.stall_since(from, pace),
        }
    }

    /// One line.
    pub(super) fn print(&self, fault: &str, pace: Pace) {
        let seconds = |time: Option<Duration>| time.map_or("-".into(), |t| format!("{:.2}", t.as_secs_f64()));
        println!(
            "network | {fault:<34} | pace {:<5} | undecided {:>2} | degraded {:>2} | gone after {:>5} s | back after {:>5} s | stall {:>3} ms | {}",
            pace.speed(),
            self.undecided,
            self.degraded,
            seconds(self.detected),
            seconds(self.recovered),
            self.stall.as_millis(),
            Vec::from_iter(self.reasons.iter().copied()).join(", "),
        );
    }
}
