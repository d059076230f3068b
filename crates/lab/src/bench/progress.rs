//! How far the bench is and how long it still takes.

use std::time::{Duration, Instant};

use curionav_deployment::follow::progress_bar;
use curionav_runtime::print::note;
use indicatif::{HumanDuration, ProgressBar};

/// Between two lines where there is no terminal to draw a bar in.
const LINE_EVERY: Duration = Duration::from_secs(30);

/// A bar on a terminal, a line now and then elsewhere; on standard error.
pub(crate) struct Progress {
    bar: ProgressBar,
    said: Instant,
}

impl Progress {
    pub(crate) fn new(total: usize) -> Self {
        let bar = progress_bar(total as u64, "{elapsed_precise} {wide_bar} {pos} of {len} runs, {msg}");
        bar.set_message("starting");
        Self { bar, said: Instant::now() }
    }

    /// One more is done; `what` it was.
    pub(crate) fn step(&mut self, what: &str) {
        self.bar.inc(1);
        let done = self.bar.position();
        let total = self.bar.length().unwrap_or_default();
        // Runs take about the same time each.
        let each = self.bar.elapsed().div_f64(done as f64);
        let left = HumanDuration(each.mul_f64(total.saturating_sub(done) as f64));
        self.bar.set_message(format!("{left} left, {what}"));
        if self.bar.is_hidden() && self.said.elapsed() >= LINE_EVERY {
            note(format_args!("{done} of {total} runs, {left} left"));
            self.said = Instant::now();
        }
    }

    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
