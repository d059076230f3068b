//! How often a test is tried, and at which pace.
//!
//! A deployment of 16 processes needs a share of a processor that a slow or busy machine does not have at 10 Hz. A test
//! that fails while its own records show that the machine stalled runs again at half the pace, down to an eighth; there
//! it must pass.

use std::sync::atomic::{AtomicU32, Ordering};
use std::time::Duration;

use super::figures::Figures;
use super::invariants;
use super::namespaces::Network;
use super::site::{Layout, Site};
pub(super) use crate::pace::Pace;

/// A machine that stalls for longer than this at 10 Hz makes questions late by itself: from then on an answer may be
/// asked of another replica as well.
const STALL_MAX: Duration = Duration::from_millis(10);
/// How often a test is tried at one pace on a machine that stalls.
const ATTEMPTS: u32 = 2;

/// Attempts that failed for a stall. The next test begins at the pace that the last one ended with: the machine is no
/// faster for it.
static FAILED: AtomicU32 = AtomicU32::new(0);

/// The machine did not keep the pace.
#[derive(Debug)]
pub(super) struct TooSlow;

pub(super) type Kept<T = ()> = Result<T, TooSlow>;

impl Pace {
    /// Something was not as it must be, which is excused if the machine stalled for as long as `stall` and there is
    /// another attempt. Else the test fails and says `what`.
    pub(super) fn excuse(self, stall: Duration, what: impl FnOnce() -> String) -> TooSlow {
        let excused = stall > self.scaled(STALL_MAX) && !self.is_last;
        assert!(excused, "at {} of the pace, stalled for {stall:?}: {}", self.speed(), what());
        println!("network | the machine stalled for {stall:?} at {} of the pace: {}", self.speed(), what());
        TooSlow
    }
}

/// Plays `test` on a site, more slowly if this machine does not keep the pace. Nothing happens, but for a line that
/// says why, where there can be no network namespaces.
#[track_caller]
pub(super) fn play(layout: &Layout, test: impl Fn(&mut Site) -> Kept) {
    if let Err(reason) = Network::new() {
        curionav_testing::skip(&format!("it needs root and network namespaces ({reason})"));
        return;
    }
    let mut at_slowest = 0;
    loop {
        let mut pace = Pace::halved(FAILED.load(Ordering::Relaxed) / ATTEMPTS);
        at_slowest += u32::from(pace.is_slowest());
        pace.is_last = at_slowest == ATTEMPTS;
        let mut site = Site::new(layout, pace);
        let kept = site.start(layout).and_then(|()| test(&mut site));
        // A slow machine excuses other things, but none of these.
        invariants::check(site.recorder());
        if kept.is_ok() {
            let record = site.recorder().record();
            assert!(record.reports.len() > 20 && record.commands.len() > 20, "too little was recorded");
            return;
        }
        FAILED.fetch_add(1, Ordering::Relaxed);
    }
}

/// Tries a fault, whose figures must be as `is_met` says unless a stall is the excuse.
pub(super) fn measured(
    fault: &str,
    site: &mut Site,
    is_met: impl Fn(&Figures) -> bool,
    attempt: impl FnOnce(&mut Site) -> Kept<Figures>,
) -> Kept {
    let pace = site.pace;
    let figures = attempt(site)?;
    figures.print(fault, pace);
    if is_met(&figures) {
        return Ok(());
    }
    Err(pace.excuse(figures.stall, || format!("{fault}: {figures:?}\n{}", site.recorder().last())))
}
