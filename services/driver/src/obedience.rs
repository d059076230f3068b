//! Which decisions the driver obeys.

use curionav_schemas::Decision;

/// The newest decision obeyed. A decision counts only if it is newer: of a newer arbiter, or of the same one
/// and later. So neither a late message nor an arbiter that was replaced but lives on changes anything.
#[derive(Debug, Clone, Default)]
pub struct Obedience {
    newest: Option<Decision>,
}

impl Obedience {
    /// Takes a decision if it is newer than every one before; whether it was.
    pub fn take(&mut self, decision: Decision) -> bool {
        let order = |d: &Decision| (d.epoch, d.seq);
        let newer = self.newest.as_ref().is_none_or(|newest| order(&decision) > order(newest));
        if newer {
            self.newest = Some(decision);
        }
        newer
    }

    /// The decision to follow.
    pub fn newest(&self) -> Option<&Decision> {
        self.newest.as_ref()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_schemas::golden;

    #[test]
    fn order_counts_and_arrival_does_not() {
        let mut obedience = Obedience::default();
        let taken = [(1, 5), (1, 4), (1, 5), (1, 6), (3, 1), (2, 99), (1, 7), (3, 2)]
            .map(|(epoch, seq)| obedience.take(Decision { epoch, seq, ..golden::decision() }));
        assert_eq!(taken, [true, false, false, true, true, false, false, true]);
        assert_eq!(obedience.newest().map(|d| (d.epoch, d.seq)), Some((3, 2)));
    }
}
