//! The few statistics that reports need: nothing here knows what is measured.

mod bootstrap;
mod signed_rank;

pub(crate) use bootstrap::mean_interval;
pub(crate) use signed_rank::signed_rank;

/// Arithmetic mean; nothing of nothing.
pub(crate) fn mean(values: &[f64]) -> Option<f64> {
    (!values.is_empty()).then(|| values.iter().sum::<f64>() / values.len() as f64)
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
    fn spread_is_that_of_a_sample() {
        // Mean 5, squares 9 + 1 + 1 + 9 = 20, over 3.
        let values = [2.0, 4.0, 6.0, 8.0];
        assert_eq!(mean(&values), Some(5.0));
        assert!((standard_deviation(&values).unwrap() - (20.0_f64 / 3.0).sqrt()).abs() < 1e-12);
        assert_eq!((mean(&[]), standard_deviation(&[]), standard_deviation(&[3.0])), (None, None, Some(0.0)));
    }
}
