//! Which arbiter the driver follows, and which of its decisions.

use curionav_schemas::{Clock, Decision};

/// An arbiter of which no newer decision has come for so long has lost the robot to the next that decides, seconds of
/// the robot's clock: two cycles of the paper's planner.
pub const SILENCE: f64 = 0.6;

/// The newest decision taken. The driver follows the arbiter whose decision it takes first, for as long as newer ones
/// come: so neither a late message nor a second arbiter changes anything. Once that arbiter is silent, the next one
/// that decides takes its place, and an arbiter that was silent and lives on is the second one.
#[derive(Debug, Clone, Default)]
pub struct DecisionFence {
    newest: Option<Decision>,
    /// When it was taken, by the robot's clock.
    taken: f64,
    /// Whether the newest is of a time that is over: it leads nowhere.
    lapsed: bool,
}

impl DecisionFence {
    /// Takes a decision at `now` of the robot's clock, if it is newer than the last and of the arbiter that is
    /// followed, or if that one is silent; whether it is taken. In lockstep an arbiter is silent if it has not decided
    /// for a tick for which another has.
    pub fn admit(&mut self, decision: Decision, now: f64, clock: Clock) -> bool {
        let admitted = self.newest.as_ref().is_none_or(|newest| {
            let is_newer = decision.epoch == newest.epoch && decision.seq > newest.seq;
            // After a decision that no arbiter could follow, that arbiter counts as silent, too.
            let is_silent = match clock {
                Clock::Lockstep => decision.tick > newest.tick || self.lapsed,
                Clock::Realtime => {
                    let is_fresh = (now - decision.stamp).abs() <= SILENCE;
                    is_fresh && !(0.0..=SILENCE).contains(&(now - self.taken))
                }
            };
            is_newer || is_silent
        });
        if admitted {
            self.newest = Some(decision);
            self.taken = now;
            self.lapsed = false;
        }
        admitted
    }

    /// The newest decision taken.
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

    fn of(epoch: u64, seq: u64, stamp: f64) -> Decision {
        Decision { epoch, seq, stamp, ..golden::decision() }
    }

    fn admit(fence: &mut DecisionFence, epoch: u64, seq: u64, now: f64) -> bool {
        fence.admit(of(epoch, seq, now), now, Clock::Realtime)
    }

    #[test]
    fn of_one_arbiter_only_what_is_newer_is_taken() {
        let mut fence = DecisionFence::default();
        let taken = [5, 4, 5, 6, 6, 9].map(|seq| admit(&mut fence, 1, seq, 10.0));
        assert_eq!(taken, [true, false, false, true, false, true]);
    }

    #[test]
    fn a_second_arbiter_is_not_heard_while_the_first_decides_whichever_number_is_greater() {
        for second in [1, 9] {
            let mut fence = DecisionFence::default();
            for k in 0..50_u32 {
                let now = 10.0 + 0.3 * f64::from(k);
                assert!(admit(&mut fence, 5, u64::from(k), now));
                assert!(!admit(&mut fence, second, 1000 + u64::from(k), now + 0.1));
            }
        }
    }

    #[test]
    fn once_the_first_is_silent_the_next_has_the_robot_and_the_first_does_not_come_back() {
        let mut fence = DecisionFence::default();
        assert!(admit(&mut fence, 5, 7, 10.0));
        assert!(!admit(&mut fence, 3, 1, 10.6));
        assert!(admit(&mut fence, 3, 2, 10.7));
        assert!(!admit(&mut fence, 5, 8, 10.8), "it has slept for a while");
        assert!(admit(&mut fence, 3, 3, 11.0));
    }

    #[test]
    fn what_comes_late_takes_no_silent_arbiters_place() {
        let mut fence = DecisionFence::default();
        assert!(admit(&mut fence, 5, 7, 10.0));
        assert!(!fence.admit(of(3, 1, 9.9), 12.0, Clock::Realtime));
        assert!(!fence.admit(of(3, 1, 20.0), 12.0, Clock::Realtime), "of a clock that is over");
        assert!(admit(&mut fence, 3, 2, 12.0));
    }

    #[test]
    fn a_number_near_the_end_of_all_numbers_shuts_no_arbiter_out() {
        let mut fence = DecisionFence::default();
        for (epoch, seq) in [(u64::MAX, u64::MAX), (1, u64::MAX)] {
            let now = 10.0 * (fence.newest().map_or(1.0, |_| 2.0));
            assert!(admit(&mut fence, epoch, seq, now));
            assert!(!admit(&mut fence, 1, 1, now + 0.5));
            assert!(admit(&mut fence, 1, 2, now + 0.7), "it is that of the arbiter that lives");
        }
    }

    #[test]
    fn in_lockstep_another_arbiter_takes_over_with_a_tick_that_the_first_has_not_decided() {
        let mut fence = DecisionFence::default();
        let at = |epoch, tick| Decision { tick, ..of(epoch, 1, 0.0) };
        assert!(fence.admit(at(5, 3), 0.3, Clock::Lockstep));
        assert!(!fence.admit(at(7, 3), 0.3, Clock::Lockstep));
        assert!(fence.admit(at(7, 6), 0.6, Clock::Lockstep));
    }

    #[test]
    fn what_has_lapsed_is_not_followed() {
        let mut fence = DecisionFence::default();
        assert!(admit(&mut fence, 2, 5, 10.0));
        fence.lapse();
        assert_eq!(fence.in_force(), None);
        assert!(!admit(&mut fence, 2, 5, 10.1));
        assert!(!admit(&mut fence, 1, 9, 10.1), "the arbiter that was followed lives");
        assert!(admit(&mut fence, 2, 6, 10.1));
        assert_eq!(fence.in_force().map(|d| d.seq), Some(6));
        // The robot's clock has begun anew, and the arbiter with it.
        fence.lapse();
        assert!(admit(&mut fence, 8, 1, 0.1));
    }
}
