//! How far apart ticks of one run can be.

/// Ticks by which a message may come late.
const LATE_TICKS: u64 = 10;

/// Whether `tick`, after `newest` of the same run, is of a base that has started over: it lies further back than any
/// message comes late.
pub fn has_started_over(newest: u64, tick: u64) -> bool {
    tick.saturating_add(LATE_TICKS) < newest
}
