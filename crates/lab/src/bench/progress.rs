//! How far the bench is and how long it still takes.

use std::time::{Duration, Instant};

use indicatif::{HumanDuration, ProgressBar, ProgressDrawTarget, ProgressStyle};

/// Between two lines where there is no terminal to draw a bar in.
const LINE_EVERY: Duration = Duration::from_secs(30);

/// A bar on a terminal, a line now and then elsewhere; on standard error.
pub(crate) struct Progress {
    bar: ProgressBar,
    begin: Instant,
    said: Instant,
    total: usize,
    done: usize,
}

impl Progress {
    pub(crate) fn new(total: usize) -> Self {
        let bar = ProgressBar::with_draw_target(Some(total as u64), ProgressDrawTarget::stderr());
        let style = "{elapsed_precise} {wide_bar} {pos} of {len} runs, {msg}";
        if let Ok(style) = ProgressStyle::with_template(style) {
            bar.set_style(style);
        }
        bar.set_message("starting");
        let now = Instant::now();
        Self { bar, begin: now, said: now, total, done: 0 }
    }

    /// One more is done; `what` it was.
    pub(crate) fn step(&mut self, what: &str) {
        self.done += 1;
        let left = self.left();
        self.bar.set_message(format!("{left} left, {what}"));
        self.bar.inc(1);
        if self.bar.is_hidden() && self.said.elapsed() >= LINE_EVERY {
            eprintln!("{} of {} runs, {left} left", self.done, self.total);
            self.said = Instant::now();
        }
    }

    /// Runs take about the same time each.
    fn left(&self) -> String {
        let each = self.begin.elapsed().div_f64(self.done.max(1) as f64);
        HumanDuration(each.mul_f64(self.total.saturating_sub(self.done) as f64)).to_string()
    }

    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}
