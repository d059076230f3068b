//! How many particles a belief needs: KLD-sampling (Fox, 2003).

/// Particles needed so that, with the probability of which `z` is the upper standard normal quantile,
/// the Kullback-Leibler distance between the belief and its particles stays below `err`, when the belief
/// fills `bins` histogram bins (Fox 2003, eq. 7, the Wilson-Hilferty approximation):
///
/// `n = ceil((k-1)/(2 err) * (1 - 2/(9(k-1)) + z sqrt(2/(9(k-1))))^3)`
///
/// With one bin or none the statistic has no degree of freedom and any number will do: 1, which the
/// caller's least number then raises. (ROS `amcl` takes the greatest number there, so that its
/// best-known poses are its most expensive.)
pub fn sample_size(bins: usize, err: f64, z: f64) -> usize {
    if bins <= 1 {
        return 1;
    }
    let freedom = (bins - 1) as f64;
    let spread = 2.0 / (9.0 * freedom);
    let root = 1.0 - spread + z * spread.sqrt();
    (freedom / (2.0 * err) * root * root * root).ceil() as usize
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn table_follows_the_chi_square_quantile() {
        // Exact 0.99 quantiles of chi-square with k - 1 degrees of freedom, from tables; the
        // approximation is within 1.5 % from k = 3 on, and within 3 % at k = 2.
        let exact = [(2, 6.635), (3, 9.210), (5, 13.277), (10, 21.666), (20, 36.191), (31, 50.892)];
        for (k, quantile) in exact {
            let n = sample_size(k, 0.05, 2.326_347_874) as f64;
            let expected = quantile / 0.1;
            let tolerance = if k == 2 { 0.03 } else { 0.015 };
            assert!((n / expected - 1.0).abs() < tolerance, "k {k}: {n} vs {expected}");
        }
    }

    #[test]
    fn table_for_two_to_fifty_bins_is_the_formula_and_grows() {
        let mut last = sample_size(1, 0.05, 2.326_347_874);
        for k in 2..=50_usize {
            // the formula in other words: m [1 - a + z sqrt(a)]^3 / (2 err), a = 2 / (9 m)
            let m = (k - 1) as f64;
            let a = 2.0 / 9.0 / m;
            let reference = (m / 0.1 * (1.0 - a + 2.326_347_874 * a.sqrt()).powi(3)).ceil() as usize;
            let n = sample_size(k, 0.05, 2.326_347_874);
            assert!(n.abs_diff(reference) <= 1 && n > last, "k {k}: {n} vs {reference}");
            last = n;
        }
        // k = 2 by hand: 10 * (1 - 0.2222 + 2.3263 * 0.4714)^3 = 10 * 1.8744^3 = 65.86
        assert_eq!(sample_size(2, 0.05, 2.326_347_874), 66);
        // k = 50 by hand: 490 * (1 - 0.004535 + 2.3263 * 0.067344)^3 = 490 * 1.152130^3 = 749.38
        assert_eq!(sample_size(50, 0.05, 2.326_347_874), 750);
    }
}
