//! Percentile bootstrap of a mean (Efron 1979).

use curionav_planning::random::{rng, uniform};

use super::mean;

/// Samples drawn; the ends of a 95 % interval then rest on 100 of them each.
const RESAMPLES: usize = 4000;
/// Share of the samples beyond each end.
const TAIL: f64 = 0.025;

/// The 95 % interval of the mean of `values`, the same for the same `seed`; nothing of nothing.
pub(crate) fn mean_interval(values: &[f64], seed: u64) -> Option<(f64, f64)> {
    let exact = mean(values)?;
    if values.iter().all(|v| *v == values[0]) {
        return Some((exact, exact));
    }
    let mut rng = rng(seed, 0);
    let count = values.len();
    let draw = |rng: &mut _| values[((uniform(rng) * count as f64) as usize).min(count - 1)];
    let mut means: Vec<f64> =
        (0..RESAMPLES).map(|_| (0..count).map(|_| draw(&mut rng)).sum::<f64>() / count as f64).collect();
    means.sort_by(f64::total_cmp);
    let at = |share: f64| means[(share * (RESAMPLES - 1) as f64).round() as usize];
    Some((at(TAIL), at(1.0 - TAIL)))
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
}
