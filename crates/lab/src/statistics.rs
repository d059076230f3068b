//! Mean, median and the bootstrap (Efron 1979) of a mean.

use curionav_planning::random::{rng, uniform};

/// Samples drawn; the ends of a 95 % interval then rest on 100 of them each.
const RESAMPLES: usize = 4000;
/// Share of the samples beyond each end.
const TAIL: f64 = 0.025;

/// Arithmetic mean; nothing of nothing.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
}

/// The middle value, or the mean of the two in the middle; nothing of nothing.
pub(crate) fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let middle = sorted.get(sorted.len() / 2)?;
    Some(0.5 * (sorted[(sorted.len() - 1) / 2] + middle))
}

/// The 95 % percentile interval of the mean of `values`, the same for the same `seed`; nothing of nothing.
pub(crate) fn mean_interval(values: &[f64], seed: u64) -> Option<(f64, f64)> {
    let count = values.len();
    let first = *values.first()?;
    if values.iter().all(|value| *value == first) {
        return Some((first, first));
    }
    let mut rng = rng(seed, 0);
    let mut means = Vec::with_capacity(RESAMPLES);
    for _ in 0..RESAMPLES {
        let drawn = (0..count).map(|_| values[((uniform(&mut rng) * count as f64) as usize).min(count - 1)]);
        means.push(drawn.sum::<f64>() / count as f64);
    }
    means.sort_by(f64::total_cmp);
    let last = (RESAMPLES - 1) as f64;
    Some((means[(TAIL * last).round() as usize], means[((1.0 - TAIL) * last).round() as usize]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_interval_is_near_that_of_the_normal_law_and_repeats() {
        let values: Vec<f64> = (0..100).map(f64::from).collect();
        let (low, high) = mean_interval(&values, 7).unwrap();
        // 49.5 +- 1.96 * 28.866 / 10, the standard deviation of 0..99 being sqrt((100^2 - 1) / 12).
        assert!((low - (49.5 - 5.658)).abs() < 0.35 && (high - (49.5 + 5.658)).abs() < 0.35, "{low} {high}");
        assert_eq!(mean_interval(&values, 7), Some((low, high)));
        assert_ne!(mean_interval(&values, 8), Some((low, high)));
    }

    #[test]
    fn equal_values_leave_no_doubt_and_none_leave_nothing() {
        assert_eq!(mean_interval(&[0.3, 0.3, 0.3], 1), Some((0.3, 0.3)));
        assert_eq!(mean_interval(&[], 1), None);
    }

    #[test]
    fn the_middle_of_an_even_number_of_values_is_between_two() {
        assert_eq!(mean(&[2.0, 4.0, 6.0, 8.0]), Some(5.0));
        assert_eq!(median(&[3.0, 1.0, 99.0]), Some(3.0));
        assert_eq!(median(&[4.0, 1.0, 2.0, 99.0]), Some(3.0));
        assert_eq!((mean(&[]), median(&[])), (None, None));
    }
}
