//! The few statistics that reports need: nothing here knows what is measured.

mod bootstrap;
mod signed_rank;

pub(crate) use bootstrap::{cluster_interval, mean_interval};
pub(crate) use signed_rank::{least_p, signed_rank};

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

/// The 95 % interval of a share of which `hits` of `all` were found (Wilson 1927); nothing of nothing.
pub(crate) fn share_interval(hits: usize, all: usize) -> Option<(f64, f64)> {
    const Z: f64 = 1.959_963_984_540_054;
    let n = (all > 0).then_some(all as f64)?;
    let share = hits as f64 / n;
    let middle = share + Z * Z / (2.0 * n);
    let half = Z * (share * (1.0 - share) / n + Z * Z / (4.0 * n * n)).sqrt();
    let whole = 1.0 + Z * Z / n;
    Some((((middle - half) / whole).max(0.0), ((middle + half) / whole).min(1.0)))
}

/// The p of each test, corrected for their number so that the chance of any false alarm among all is what each says
/// (Holm 1979).
pub(crate) fn holm(p: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..p.len()).collect();
    order.sort_by(|a, b| p[*a].total_cmp(&p[*b]));
    let (mut corrected, mut least) = (vec![0.0; p.len()], 0.0_f64);
    for (rank, &test) in order.iter().enumerate() {
        least = least.max((p.len() - rank) as f64 * p[test]).min(1.0);
        corrected[test] = least;
    }
    corrected
}

/// Sample standard deviation (n - 1); 0 for a single value, nothing of nothing.
pub(crate) fn standard_deviation(values: &[f64]) -> Option<f64> {
    let mean = mean(values)?;
    let squares: f64 = values.iter().map(|v| (v - mean) * (v - mean)).sum();
    Some((squares / (values.len().max(2) - 1) as f64).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_share_that_was_always_found_is_not_certain() {
        // All of ten: from 1 / (1 + 1.96^2 / 10) = 0.7225; half of a hundred: 0.4038 to 0.5962.
        let (low, high) = share_interval(10, 10).unwrap();
        assert!((low - 0.7225).abs() < 1e-4 && (high - 1.0).abs() < 1e-12, "{low} {high}");
        let (low, high) = share_interval(50, 100).unwrap();
        assert!((low - 0.4038).abs() < 1e-4 && (high - 0.5962).abs() < 1e-4, "{low} {high}");
        assert_eq!(share_interval(0, 0), None);
    }

    #[test]
    fn the_least_p_is_multiplied_by_the_number_of_tests_and_no_greater_one_falls_below_it() {
        let corrected = holm(&[0.01, 0.04, 0.03, 0.005]);
        // 4 * 0.005, 3 * 0.01, 2 * 0.03, and no less than that for 0.04
        for (found, expected) in corrected.iter().zip([0.03, 0.06, 0.06, 0.02]) {
            assert!((found - expected).abs() < 1e-12, "{corrected:?}");
        }
        assert_eq!((holm(&[]), holm(&[0.9, 0.8])), (vec![], vec![1.0, 1.0]));
    }

    #[test]
    fn spread_is_that_of_a_sample() {
        // Mean 5, squares 9 + 1 + 1 + 9 = 20, over 3.
        let values = [2.0, 4.0, 6.0, 8.0];
        assert_eq!(mean(&values), Some(5.0));
        assert!((standard_deviation(&values).unwrap() - (20.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!(
            (median(&[3.0, 1.0, 99.0]), median(&[4.0, 1.0, 2.0, 99.0]), median(&[])),
            (Some(3.0), Some(3.0), None)
        );
        assert_eq!((mean(&[]), standard_deviation(&[]), standard_deviation(&[3.0])), (None, None, Some(0.0)));
    }
}
