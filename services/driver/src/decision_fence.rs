//! Which decisions the driver follows.

use curionav_schemas::Decision;
use curionav_schemas::limits::{MAX_EPOCH_STEP, MAX_FIRST_EPOCH};

/// What became of a decision.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Admission {
    /// It is followed from now on.
    Admitted,
    /// It is not newer than what is followed.
    Older,
    /// Its epoch is so far ahead that it is no arbiter's.
    OutOfReach,
}

/// The newest decision admitted. A decision counts only if it is newer: of a newer arbiter, or of the same one
/// and later. So neither a late message nor an arbiter that was replaced but lives on changes anything. Nor may
/// the epoch leap: after one near the end of all numbers no arbiter could be newer.
#[derive(Debug, Clone, Default)]
pub struct DecisionFence {
    newest: Option<Decision>,
    /// Whether the newest is of a time that is over: it still outranks older ones, but leads nowhere.
    lapsed: bool,
}

impl DecisionFence {
    /// Takes a decision if it is newer than every one before.
    pub fn admit(&mut self, decision: Decision) -> Admission {
        let newest = self.newest.as_ref();
        if newest.is_some_and(|newest| (decision.epoch, decision.seq) <= (newest.epoch, newest.seq)) {
            return Admission::Older;
        }
        let reach = self.newest.as_ref().map_or(MAX_FIRST_EPOCH, |d| d.epoch.saturating_add(MAX_EPOCH_STEP));
        if decision.epoch > reach {
            return Admission::OutOfReach;
        }
        self.newest = Some(decision);
        self.lapsed = false;
        Admission::Admitted
    }

    /// The newest decision admitted.
    pub fn newest(&self) -> Option<&Decision> {
        self.newest.as_ref()
    }

    /// The decision to follow.
    pub fn in_force(&self) -> Option<&Decision> {
        self.newest.as_ref().filter(|_| !self.lapsed)
    }

    /// Ends the force of the newest decision: when the robot's clock begins anew its stamp comes again, and so does its
    /// validity.
    pub fn lapse(&mut self) {
        self.lapsed = true;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    fn of(epoch: u64, seq: u64) -> Decision {
        Decision { epoch, seq, ..golden::decision() }
    }

    #[test]
    fn order_counts_and_arrival_does_not() {
        let mut fence = DecisionFence::default();
        let taken = [(1, 5), (1, 4), (1, 5), (1, 6), (3, 1), (2, 99), (1, 7), (3, 2)]
            .map(|(epoch, seq)| fence.admit(of(epoch, seq)) == Admission::Admitted);
        assert_eq!(taken, [true, false, false, true, true, false, false, true]);
        assert_eq!(fence.newest().map(|d| (d.epoch, d.seq)), Some((3, 2)));
    }

    #[test]
    fn what_has_lapsed_is_not_followed_but_still_outranks() {
        let mut fence = DecisionFence::default();
        fence.admit(of(2, 5));
        fence.lapse();
        assert_eq!(fence.in_force(), None);
        assert_eq!(fence.newest().map(|d| (d.epoch, d.seq)), Some((2, 5)));
        assert_eq!(fence.admit(of(2, 5)), Admission::Older);
        assert_eq!(fence.admit(of(1, 9)), Admission::Older);
        assert_eq!(fence.in_force(), None);
        assert_eq!(fence.admit(of(2, 6)), Admission::Admitted);
        assert_eq!(fence.in_force().map(|d| d.seq), Some(6));
    }

    #[test]
    fn no_epoch_shuts_out_those_that_follow() {
        for first in [1, 1 << 40, MAX_FIRST_EPOCH] {
            let mut fence = DecisionFence::default();
            assert_eq!(fence.admit(of(u64::MAX, 1)), Admission::OutOfReach);
            assert_eq!(fence.admit(of(MAX_FIRST_EPOCH + 1, 1)), Admission::OutOfReach);
            assert_eq!(fence.admit(of(first, u64::MAX)), Admission::Admitted);
            assert_eq!(fence.admit(of(u64::MAX, 1)), Admission::OutOfReach);
            assert_eq!(fence.admit(of(first + MAX_EPOCH_STEP + 1, 1)), Admission::OutOfReach);
            assert_eq!(fence.admit(of(first + MAX_EPOCH_STEP, 1)), Admission::Admitted);
            assert_eq!(fence.admit(of(first + MAX_EPOCH_STEP + 1, 1)), Admission::Admitted);
        }
    }
}
