//! Least, mean and greatest of speed and its derivatives along a track.

/// Extremes and mean of a quantity.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Spread {
    pub(super) least: f64,
    pub(super) mean: f64,
    pub(super) most: f64,
}

impl Spread {
    /// Of (time, value) rows; all zero without any.
    pub(super) fn signed(rows: &[(f64, f64)]) -> Self {
        Self::with(rows, |value| value)
    }

    /// The same with the mean of magnitudes: a robot that starts and ends at rest has a mean acceleration of
    /// nothing.
    pub(super) fn of_changes(rows: &[(f64, f64)]) -> Self {
        Self::with(rows, f64::abs)
    }

    fn with(rows: &[(f64, f64)], averaged: impl Fn(f64) -> f64) -> Self {
        if rows.is_empty() {
            return Self::default();
        }
        let values = || rows.iter().map(|(_, value)| *value);
        Self {
            least: values().fold(f64::INFINITY, f64::min),
            mean: values().map(averaged).sum::<f64>() / rows.len() as f64,
            most: values().fold(f64::NEG_INFINITY, f64::max),
        }
    }
}

/// Rates of change between neighbours of (time, value) rows, each at the later row's time.
pub(super) fn differences(rows: &[(f64, f64)]) -> Vec<(f64, f64)> {
    rows.windows(2)
        .filter(|pair| pair[1].0 > pair[0].0)
        .map(|pair| (pair[1].0, (pair[1].1 - pair[0].1) / (pair[1].0 - pair[0].0)))
        .collect()
}
