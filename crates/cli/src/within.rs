//! Numbers on the command line that have a range.

use std::ops::RangeInclusive;

/// A number in a range; `expected` says which.
pub(crate) fn parse_within(text: &str, range: RangeInclusive<f64>, expected: &str) -> Result<f64, String> {
    text.parse().ok().filter(|number| range.contains(number)).ok_or_else(|| expected.to_owned())
}
