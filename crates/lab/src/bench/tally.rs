//! How runs ended.

use curionav_schemas::Outcome;
use serde::Serialize;

use super::row::Row;

/// Counts of runs, but for `contacts`.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Tally {
    pub(crate) runs: usize,
    /// At the goal without a collision.
    pub(crate) success: usize,
    pub(crate) reached: usize,
    pub(crate) timeouts: usize,
    pub(crate) lost: usize,
    /// Runs with a collision.
    pub(crate) collided: usize,
    /// Collisions in all.
    pub(crate) contacts: u32,
    /// Runs with a cycle that was decided in a degraded mode.
    pub(crate) degraded: usize,
}

impl Tally {
    pub(crate) fn of<'a>(rows: impl Iterator<Item = &'a Row>) -> Self {
        rows.fold(Self::default(), |t, row| Self {
            runs: t.runs + 1,
            success: t.success + usize::from(row.is_success()),
            reached: t.reached + usize::from(row.outcome == Outcome::Reached),
            timeouts: t.timeouts + usize::from(row.outcome == Outcome::Timeout),
            lost: t.lost + usize::from(row.outcome == Outcome::Lost),
            collided: t.collided + usize::from(row.measures.collisions > 0),
            contacts: t.contacts + row.measures.collisions,
            degraded: t.degraded + usize::from(row.cycles.degraded > 0),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::row::tests::row;
    use super::*;

    #[test]
    fn a_run_with_a_collision_arrived_but_is_no_success() {
        let mut rows = [row("a", "b", 1), row("a", "b", 2), row("a", "b", 3)];
        rows[0].measures.collisions = 3;
        rows[2].outcome = Outcome::Lost;
        let tally = Tally::of(rows.iter());
        assert_eq!((tally.runs, tally.success, tally.reached, tally.lost), (3, 1, 2, 1));
        assert_eq!((tally.collided, tally.contacts), (1, 3));
    }
}
