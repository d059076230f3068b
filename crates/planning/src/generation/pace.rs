//! How much time a generator has left.

use std::cell::Cell;

/// How much of the time for an answer is over. A generator ends early by it only in an emergency, because an answer
/// that is cut short depends on the machine.
pub struct Pace<'a> {
    spent: &'a dyn Fn() -> f64,
    cut: Cell<bool>,
}

impl<'a> Pace<'a> {
    /// Share of the time after which nothing grows any more: the rest is for making candidates of what has grown.
    pub const GROWTH: f64 = 0.6;

    /// `spent` gives the share of the time that is over, 1 or more when all of it is.
    pub fn new(spent: &'a dyn Fn() -> f64) -> Self {
        Self { spent, cut: Cell::new(false) }
    }

    /// For work that is done whatever time it takes.
    pub(super) fn endless() -> Pace<'static> {
        Pace::new(&|| 0.0)
    }

    /// Whether so much of the time is over that what takes until `share` of it has to end. The answer is then cut
    /// short.
    pub fn is_over(&self, share: f64) -> bool {
        let is_over = (self.spent)() >= share;
        self.cut.set(self.cut.get() || is_over);
        is_over
    }

    /// Whether anything had to end.
    pub fn has_cut(&self) -> bool {
        self.cut.get()
    }
}
