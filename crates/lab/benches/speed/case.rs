//! One thing to be timed, and how its time is taken beside the reference's.

use std::hint::black_box;
use std::time::{Duration, Instant};

use crate::reference::Reference;

/// How long one case and the reference beside it are repeated.
const PATIENCE: Duration = Duration::from_millis(400);
/// Repeats of a case at least, also when one takes longer than that.
const REPEATS_MIN: usize = 3;

/// What one repeat came to.
pub(crate) struct Sample {
    /// Of the work alone.
    pub(crate) time: Duration,
    /// What else is worth a look.
    pub(crate) note: String,
}

/// Something to be timed: its name, and a function that does it once.
pub(crate) struct Case {
    /// `theme/what/size`.
    pub(crate) name: String,
    once: Box<dyn FnMut() -> Sample>,
    repeats_min: usize,
}

/// The least time of a case and of the reference in the same stretch of time.
pub(crate) struct Measured {
    pub(crate) time: Duration,
    pub(crate) reference: Duration,
    pub(crate) note: String,
}

impl Measured {
    /// How many times as long as the reference it took.
    pub(crate) fn ratio(&self) -> f64 {
        self.time.as_secs_f64() / self.reference.as_secs_f64()
    }

    /// The least times of both.
    pub(crate) fn or(self, other: Self) -> Self {
        if other.ratio() < self.ratio() { other } else { self }
    }
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

    /// Repeats it, with the reference in between: blocks of about the same length, so that both meet the same noise.
    pub(crate) fn measure(&mut self, reference: &mut Reference) -> Measured {
        let first = (self.once)();
        let mut least = Measured { time: first.time, reference: reference.time(), note: first.note };
        let (started, mut repeats) = (Instant::now(), 0);
        while repeats + 1 < self.repeats_min || (self.repeats_min > 1 && started.elapsed() < PATIENCE) {
            let block = Instant::now();
            loop {
                least.time = least.time.min((self.once)().time);
                repeats += 1;
                if block.elapsed() >= least.reference {
                    break;
                }
            }
            least.reference = least.reference.min(reference.time());
        }
        (0..10).for_each(|_| least.reference = least.reference.min(reference.time()));
        least
    }
}

/// The work and nothing else: callgrind counts what happens below a function of this name.
#[inline(never)]
fn measured_work<I, T>(work: &mut impl FnMut(I) -> T, input: I) -> T {
    work(input)
}
