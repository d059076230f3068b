//! Wilcoxon's signed-rank test (1945) of paired differences.
//!
//! Differences of zero are left out and ties share their mean rank. The law of the rank sum is exact, given the
//! ties, up to [`EXACT_UP_TO`] pairs: each difference's sign is a fair coin, so the law is built up one
//! difference after the other. Beyond, it is taken as normal with the variance of the ranks as they are.

/// Pairs up to which the law is exact; it takes time with the cube of their number.
const EXACT_UP_TO: usize = 300;

/// The two-sided p of the hypothesis that the differences are symmetric around zero; 1 when all are zero, nothing
/// without differences.
pub(crate) fn signed_rank(differences: &[f64]) -> Option<f64> {
    if differences.is_empty() {
        return None;
    }
    let mut nonzero: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
    nonzero.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
    let ranks = doubled_ranks(&nonzero);
    let positive: usize = nonzero.iter().zip(&ranks).filter(|(d, _)| **d > 0.0).map(|(_, r)| r).sum();
    let p = if nonzero.len() <= EXACT_UP_TO { exact(&ranks, positive) } else { normal(&ranks, positive) };
    Some(p.min(1.0))
}

/// The least p that so many differences can have: that of all in one direction. It is also the share of cases in which the
/// median lies outside of all of so many samples.
pub(crate) fn least_p(differences: usize) -> f64 {
    0.5_f64.powf(differences as f64 - 1.0).min(1.0)
}

/// Twice the rank of each value by size, from 1: whole numbers also where ties share a mean rank.
fn doubled_ranks(sorted: &[f64]) -> Vec<usize> {
    let mut ranks = Vec::with_capacity(sorted.len());
    while let Some(first) = sorted.get(ranks.len()) {
        let start = ranks.len();
        let tied = sorted[start..].iter().take_while(|v| v.abs() == first.abs()).count();
        // Ranks start + 1 to start + tied; twice their mean.
        ranks.extend(std::iter::repeat_n(2 * start + tied + 1, tied));
    }
    ranks
}

/// Twice the smaller tail of the exact law, at most 1.
fn exact(ranks: &[usize], observed: usize) -> f64 {
    let total: usize = ranks.iter().sum();
    // [sum] probability that the positive ranks add up to it.
    let mut law = vec![0.0; total + 1];
    law[0] = 1.0;
    let mut reached = 0;
    for rank in ranks {
        reached += rank;
        for sum in (0..=reached).rev() {
            let with = if sum >= *rank { law[sum - rank] } else { 0.0 };
            law[sum] = 0.5 * (law[sum] + with);
        }
    }
    // The law is symmetric around half the total.
    let lower = observed.min(total - observed);
    (2.0 * law[..=lower].iter().sum::<f64>()).min(1.0)
}

fn normal(ranks: &[usize], observed: usize) -> f64 {
    let ranks: Vec<f64> = ranks.iter().map(|r| *r as f64 / 2.0).collect();
    let middle = ranks.iter().sum::<f64>() / 2.0;
    let deviation = (ranks.iter().map(|r| r * r).sum::<f64>() / 4.0).sqrt();
    let z = (observed as f64 / 2.0 - middle).abs() / deviation;
    libm::erfc(z / std::f64::consts::SQRT_2)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every assignment of signs, counted.
    fn slow(differences: &[f64]) -> f64 {
        let mut nonzero: Vec<f64> = differences.iter().copied().filter(|d| *d != 0.0).collect();
        nonzero.sort_by(|a, b| a.abs().total_cmp(&b.abs()));
        let ranks = doubled_ranks(&nonzero);
        let total: i64 = ranks.iter().map(|r| *r as i64).sum();
        let off = |sum: i64| (2 * sum - total).abs();
        let observed: i64 =
            nonzero.iter().zip(&ranks).filter(|(d, _)| **d > 0.0).map(|(_, r)| *r as i64).sum();
        let signs = 0_u32..1 << ranks.len();
        let sum =
            |signs: u32| (0..ranks.len()).filter(|i| signs >> i & 1 == 1).map(|i| ranks[i] as i64).sum();
        let count = signs.clone().filter(|signs| off(sum(*signs)) >= off(observed)).count();
        count as f64 / signs.len() as f64
    }

    fn assert_near(found: Option<f64>, expected: f64) {
        let found = found.unwrap();
        assert!((found / expected - 1.0).abs() < 1e-9, "{found}, not {expected}");
    }

    #[test]
    #[expect(clippy::approx_constant, reason = "3.14 is a score")]
    fn the_textbook_example_has_its_p() {
        // Depression scores of nine patients (Hollander and Wolfe); R gives V = 40, p = 0.03906.
        let before = [1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30];
        let after = [0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29];
        let differences: Vec<f64> = before.iter().zip(after).map(|(b, a)| b - a).collect();
        assert_near(signed_rank(&differences), 0.0390625);
    }

    #[test]
    fn ten_of_one_sign_are_two_in_two_to_the_tenth() {
        assert_near(signed_rank(&[1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0]), 2.0 / 1024.0);
    }

    #[test]
    fn ties_and_zeros_agree_with_counting_every_sign() {
        let differences = [1.0, 1.0, 2.0, -2.0, 3.0, -1.0, 4.0, 4.0, -5.0, 0.0, 0.0, 6.0];
        assert_near(signed_rank(&differences), 0.23828125);
        assert_near(signed_rank(&differences), slow(&differences));
        assert_near(signed_rank(&[-1.0, -1.0, -1.0, 2.0, 0.0]), slow(&[-1.0, -1.0, -1.0, 2.0]));
    }

    #[test]
    fn many_pairs_are_taken_as_normal() {
        // 396 of 400 differences are not zero; SciPy gives 7.992403732131257e-10 for the same.
        let differences: Vec<f64> = (0..400).map(|i| f64::from((i * 37) % 101 - 40) / 10.0).collect();
        assert_near(signed_rank(&differences), 7.992403732131257e-10);
    }

    #[test]
    fn no_difference_is_no_evidence() {
        assert_eq!(signed_rank(&[0.0, 0.0]), Some(1.0));
        assert_eq!(signed_rank(&[]), None);
    }
}
