//! What a fault cost, measured, and printed as a line of a table.

use std::collections::BTreeSet;
use std::time::{Duration, Instant};

use super::recorder::Record;
use super::site::Site;

/// A machine that stalls for longer than this makes questions late by itself: at 10 Hz a question may take so
/// long before another replica is asked.
const STALL_MAX: Duration = Duration::from_millis(10);
/// Between two ticks of the simulator.
const PERIOD: Duration = Duration::from_millis(100);
/// How often a fault is tried on a machine that stalls.
const ATTEMPTS: usize = 4;

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
    pub(super) reasons: BTreeSet<String>,
    /// The longest stall of this machine meanwhile.
    pub(super) stall: Duration,
}

impl Figures {
    /// Of all since `from`.
    pub(super) fn since(record: &Record, from: Instant) -> Self {
        let decided: BTreeSet<u64> = record.decisions.iter().map(|(_, d)| d.tick).collect();
        let last = decided.last().copied().unwrap_or_default();
        let ticks = record.odometry.iter().filter(|(at, _)| *at >= from).map(|(_, o)| o.tick);
        let after = || record.decisions.iter().filter(|(at, _)| *at >= from).map(|(_, d)| d);
        let naps = record.stalls.iter().filter(|(at, _)| *at >= from).map(|(_, stall)| *stall);
        // Nobody holds the simulator up: a tick that comes late was kept from the processor.
        let late = record.odometry.windows(2).filter(|pair| pair[0].0 >= from).map(|pair| {
            let ticks = u32::try_from(pair[1].1.tick.saturating_sub(pair[0].1.tick)).unwrap_or(u32::MAX);
            (pair[1].0 - pair[0].0).saturating_sub(PERIOD.saturating_mul(ticks))
        });
        Self {
            undecided: ticks.filter(|tick| *tick < last && !decided.contains(tick)).count(),
            degraded: after().filter(|d| !d.degraded.is_empty()).count(),
            reasons: after().flat_map(|d| d.degraded.iter().cloned()).collect(),
            detected: None,
            recovered: None,
            stall: naps.chain(late).max().unwrap_or_default(),
        }
    }

    /// One line.
    pub(super) fn print(&self, fault: &str) {
        let seconds = |time: Option<Duration>| time.map_or("-".into(), |t| format!("{:.2}", t.as_secs_f64()));
        println!(
            "network | {fault:<34} | undecided {:>2} | degraded {:>2} | gone after {:>5} s | back after {:>5} s | stall {:>3} ms | {}",
            self.undecided,
            self.degraded,
            seconds(self.detected),
            seconds(self.recovered),
            self.stall.as_millis(),
            Vec::from_iter(self.reasons.iter().map(String::as_str)).join(", "),
        );
    }
}

/// Tries a fault until its figures are as they should be, or the machine kept pace and is no excuse.
pub(super) fn measured(
    fault: &str,
    site: &mut Site,
    is_met: impl Fn(&Figures) -> bool,
    mut attempt: impl FnMut(&mut Site) -> Figures,
) {
    for attempts in 1.. {
        let figures = attempt(site);
        figures.print(fault);
        if is_met(&figures) {
            return;
        }
        let excused = figures.stall > STALL_MAX && attempts < ATTEMPTS;
        assert!(excused, "{fault}: {figures:?}\n{}", site.recorder().last());
    }
}
