//! Least, mean and greatest of speed and its derivatives along a track.

/// Extremes and mean of a quantity; all zero without any value.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub(super) struct Spread {
    pub(super) least: f64,
    pub(super) mean: f64,
    pub(super) most: f64,
}

impl Spread {
    /// Of these values; the mean is that of what `averaged` makes of them.
    pub(super) fn of(values: impl ExactSizeIterator<Item = f64> + Clone, averaged: fn(f64) -> f64) -> Self {
        if values.len() == 0 {
            return Self::default();
        }
        Self {
            least: values.clone().fold(f64::INFINITY, f64::min),
            mean: values.clone().map(averaged).sum::<f64>() / values.len() as f64,
            most: values.fold(f64::NEG_INFINITY, f64::max),
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
