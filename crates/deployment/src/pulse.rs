//! Whether a process hangs, judged by when it answers its supervisor and by the processor time that it takes.
//!
//! Time is counted in looks of the supervisor, which come at even times on a machine that has time for them. On a
//! machine that has not, the supervisor looks more seldom, and so it waits for longer, too.

use std::time::Duration;

/// Looks from an answer to the next question.
const REST: u32 = 10;
/// Looks without an answer after which a process hangs that hardly takes any processor time: it stands still or waits
/// for itself.
const IDLE_MAX: u32 = 100;
/// The same for one that computes: it may be slow, or have much to prepare.
const BUSY_MAX: u32 = 600;
/// Processor time that a process takes at most while it stands still: that of Zenoh's threads, which keep links alive.
const IDLE: Duration = Duration::from_millis(100);

/// What the supervisor is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Verdict {
    /// Nothing.
    Wait,
    /// Ask the process whether it works.
    Ask,
    /// End it.
    Hangs,
}

/// What is known of the answers of one process.
#[derive(Debug, Default)]
pub(crate) struct Pulse {
    /// Looks since the last answer, or since the question that is open.
    looks: u32,
    /// The processor time that the process had taken when it was asked the question that is open.
    asked: Option<Duration>,
}

impl Pulse {
    /// One more look: whether the process has answered since the one before, and the processor time that it has taken
    /// in all.
    pub(crate) fn look(&mut self, has_answered: bool, used: Duration) -> Verdict {
        if has_answered {
            *self = Self::default();
        }
        self.looks += 1;
        let Some(then) = self.asked else {
            if self.looks < REST {
                return Verdict::Wait;
            }
            *self = Self { looks: 0, asked: Some(used) };
            return Verdict::Ask;
        };
        let most = if used.saturating_sub(then) <= IDLE { IDLE_MAX } else { BUSY_MAX };
        if self.looks < most { Verdict::Wait } else { Verdict::Hangs }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Looks until the verdict, of a process that takes `busy` per look and never answers.
    fn looks_until_it_hangs(busy: Duration) -> u32 {
        let mut pulse = Pulse::default();
        (1..).find(|&look| pulse.look(false, busy * look) == Verdict::Hangs).unwrap()
    }

    #[test]
    fn a_process_that_computes_is_given_longer_than_one_that_stands_still() {
        assert_eq!(looks_until_it_hangs(Duration::ZERO), REST + IDLE_MAX);
        // Keeping links alive takes 0.1 ms per look.
        assert_eq!(looks_until_it_hangs(Duration::from_micros(100)), REST + IDLE_MAX);
        // A fiftieth of a processor.
        assert_eq!(looks_until_it_hangs(Duration::from_millis(2)), REST + BUSY_MAX);
    }

    #[test]
    fn a_slow_process_that_answers_in_the_end_never_hangs_and_is_asked_one_question_at_a_time() {
        let (mut pulse, mut asked) = (Pulse::default(), 0);
        let mut open_for = 0;
        for look in 0..10_000 {
            let has_answered = open_for == 90;
            open_for = if has_answered { 0 } else { open_for };
            match pulse.look(has_answered, Duration::ZERO) {
                Verdict::Hangs => panic!("at look {look}"),
                Verdict::Ask => {
                    assert_eq!(open_for, 0, "two questions are open");
                    (asked, open_for) = (asked + 1, 1);
                }
                Verdict::Wait => open_for += u32::from(open_for > 0),
            }
        }
        assert!((95..105).contains(&asked), "{asked} questions");
    }
}
