//! One thing to be timed, and how its time is taken beside the reference's.

use std::hint::black_box;
use std::time::{Duration, Instant};

use crate::reference::Reference;

/// How long one case and the reference beside it are repeated.
const PATIENCE: Duration = Duration::from_millis(400);
/// Repeats of a case at least, also when one takes longer than that.
const REPEATS_MIN: usize = 3;

/// What one repeat came to, or the best of many.
pub(crate) struct Sample {
    /// Of the work alone.
    pub(crate) time: Duration,
    /// What else is worth a look.
    pub(crate) note: String,
}

impl Sample {
    /// The one that took less time.
    pub(crate) fn or(self, other: Self) -> Self {
        if other.time < self.time { other } else { self }
    }
}

/// Something to be timed: its name, and a function that does it once.
pub(crate) struct Case {
    /// `theme/what/size`.
    pub(crate) name: String,
    once: Box<dyn FnMut() -> Sample>,
    repeats_min: usize,
}

impl Case {
    /// Times `work`.
    pub(crate) fn new<T>(name: impl Into<String>, mut work: impl FnMut() -> T + 'static) -> Self {
        Self::after(name, 1, || (), move |()| work())
    }

    /// Times `work` on what `prepare` made, whose own time does not count. The time is divided by `count`, the
    /// number of like pieces of work.
    pub(crate) fn after<I, T>(
        name: impl Into<String>,
        count: u32,
        mut prepare: impl FnMut() -> I + 'static,
        mut work: impl FnMut(I) -> T + 'static,
    ) -> Self {
        let once = move || {
            let input = black_box(prepare());
            let started = Instant::now();
            let output = measured_work(&mut work, input);
            let time = started.elapsed() / count;
            drop(black_box(output));
            Sample { time, note: String::new() }
        };
        Self { name: name.into(), once: Box::new(once), repeats_min: REPEATS_MIN }
    }

    /// Takes the time itself; it is so long that one repeat is enough.
    pub(crate) fn long(name: impl Into<String>, once: impl FnMut() -> Sample + 'static) -> Self {
        Self { name: name.into(), once: Box::new(once), repeats_min: 1 }
    }

    /// Does it `times` times and takes no time: for a profiler.
    pub(crate) fn run(&mut self, times: usize) {
        (0..times).for_each(|_| drop((self.once)()));
    }

    /// The best of many repeats, with the reference in between: blocks of about the same length.
    pub(crate) fn measure(&mut self, reference: &mut Reference) -> Sample {
        reference.take_time();
        let mut best = (self.once)();
        let mut repeats = 1;
        let started = Instant::now();
        while repeats < self.repeats_min || (self.repeats_min > 1 && started.elapsed() < PATIENCE) {
            let block = Instant::now();
            while block.elapsed() < reference.least {
                best = best.or((self.once)());
                repeats += 1;
            }
            reference.take_time();
        }
        best
    }
}

/// The work and nothing else: callgrind counts what happens below a function of this name.
#[inline(never)]
fn measured_work<I, T>(work: &mut impl FnMut(I) -> T, input: I) -> T {
    work(input)
}
