//! When an answer is late, and how many questions that are late or refused may be asked of a second replica.
//!
//! A fixed limit would call every answer late where the whole pool is slow. Asking a second replica each time
//! doubles the load, which makes the next answers later still, and the pool never recovers. So lateness is judged
//! against the usual time of an answer, and only a few questions in a hundred are asked twice (Dean and Barroso,
//! The tail at scale, 2013; Bronson et al., Metastable failures in distributed systems, 2021).

use std::time::Duration;

/// An answer that takes longer than this share of the answers is late.
const USUAL: f64 = 0.95;
/// By this share the usual time grows with every answer that took longer than it.
const STEP: f64 = 0.1;
/// Questions that may be asked twice, as a share of all questions.
const HEDGED: f64 = 0.05;
/// Questions that may be asked twice at once: the shards of one cycle that a lost replica leaves unanswered.
const HEDGED_AT_ONCE: f64 = 8.0;

/// Time within which `USUAL` of something's times have been, as far as is known; zero until there has been one.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Usual(f64);

impl Usual {
    /// Another time. The estimate settles where longer times lift it as much as the others lower it, at the quantile
    /// `USUAL`; a time that is more than twice as long is no noise, and lifts it at once.
    pub(crate) fn took(&mut self, time: Duration) {
        let time = time.as_secs_f64();
        self.0 *= if time > self.0 { 1.0 + STEP } else { 1.0 - STEP * (1.0 - USUAL) / USUAL };
        self.0 = self.0.max(time / 2.0);
    }

    /// The estimate.
    pub(crate) fn time(&self) -> Duration {
        Duration::from_secs_f64(self.0)
    }
}

/// What is known of the answers of one role.
#[derive(Debug, Clone)]
pub(crate) struct Lateness {
    usual: Usual,
    /// Questions that may still be asked twice.
    left: f64,
}

impl Default for Lateness {
    fn default() -> Self {
        Self { usual: Usual::default(), left: HEDGED_AT_ONCE }
    }
}

impl Lateness {
    /// A question goes out; gives how long its answer is waited for before it is late, at least `at_least`.
    pub(crate) fn asked(&mut self, at_least: Duration) -> Duration {
        self.left = (self.left + HEDGED).min(HEDGED_AT_ONCE);
        at_least.max(self.usual.time())
    }

    /// A usable answer has come.
    pub(crate) fn answered(&mut self, took: Duration) {
        self.usual.took(took);
    }

    /// Whether a question that is late, or was refused as overloaded, may be asked of a second replica. Each such permission
    /// is counted.
    pub(crate) fn may_ask_twice(&mut self) -> bool {
        let may = self.left >= 1.0;
        self.left -= f64::from(u8::from(may));
        may
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::random::{rng, uniform};

    use super::*;

    const QUARTER: Duration = Duration::from_millis(10);

    #[test]
    fn one_answer_in_twenty_is_late_where_all_are_slow() {
        let (mut lateness, mut random, mut late) = (Lateness::default(), rng(1000, 0), 0);
        for question in 0..20_000 {
            let took = QUARTER.mul_f64(2.0 + uniform(&mut random));
            late += u32::from(question >= 1000 && took > lateness.asked(QUARTER));
            lateness.answered(took);
        }
        assert!((570..1330).contains(&late), "{late} of 19 000 answers were late, 950 were expected");
    }

    #[test]
    fn an_answer_in_time_is_never_late_however_fast_the_others_are() {
        let mut lateness = Lateness::default();
        (0..100).for_each(|_| lateness.answered(Duration::from_micros(300)));
        assert_eq!(lateness.asked(QUARTER), QUARTER);
    }

    #[test]
    fn only_a_few_questions_are_asked_twice_however_many_are_late() {
        let mut lateness = Lateness::default();
        let hedged = (0..2000)
            .filter(|_| {
                lateness.asked(QUARTER);
                lateness.may_ask_twice()
            })
            .count();
        // 8 at once and 2000 / 20 one after the other.
        assert!((100..=108).contains(&hedged), "{hedged}");
    }
}
