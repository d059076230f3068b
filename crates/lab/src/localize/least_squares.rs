//! Small problems of linear least squares.

use nalgebra::{DMatrix, DVector};

/// Singular values smaller than this share of the greatest count as none.
const SINGULAR: f64 = 1e-6;

/// The x for which A x is nearest to b; none if A does not tell.
pub(super) fn unbounded(a: &DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    let decomposed = a.clone().svd(true, true);
    let greatest = decomposed.singular_values.iter().copied().fold(0.0, f64::max);
    let is_told =
        a.nrows() >= a.ncols() && decomposed.singular_values.iter().all(|s| *s > SINGULAR * greatest);
    if is_told { decomposed.solve(b, 0.0).ok() } else { None }
}

/// The x for which A x is nearest to b, without negative entries (Lawson and Hanson, 1974). It tries all sets of
/// entries that may be more than nought, which is quick for a few.
pub(super) fn not_negative(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let count = a.ncols();
    let mut best = DVector::zeros(count);
    let mut least = b.norm_squared();
    for set in 1_u32..1 << count {
        let columns: Vec<usize> = (0..count).filter(|column| set & (1 << column) != 0).collect();
        let part = a.select_columns(&columns);
        let Some(found) = unbounded(&part, b) else { continue };
        let rest = (&part * &found - b).norm_squared();
        if rest < least && found.iter().all(|x| *x >= 0.0) {
            least = rest;
            best.fill(0.0);
            columns.iter().zip(found.iter()).for_each(|(column, x)| best[*column] = *x);
        }
    }
    best
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_be_negative_is_nought() {
        let a = DMatrix::from_row_slice(4, 2, &[1.0, 0.0, 2.0, 1.0, 3.0, 0.0, 4.0, 1.0]);
        let exact = not_negative(&a, &(&a * DVector::from_vec(vec![2.0, 0.5])));
        assert!((exact[0] - 2.0).abs() < 1e-9 && (exact[1] - 0.5).abs() < 1e-9, "{exact}");
        let bounded = not_negative(&a, &(&a * DVector::from_vec(vec![2.0, -0.5])));
        // b is 2, 3.5, 6, 7.5; without the second column (2 + 7 + 18 + 30) / 30.
        assert!((bounded[0] - 57.0 / 30.0).abs() < 1e-9 && bounded[1] == 0.0, "{bounded}");
    }

    #[test]
    fn what_is_not_told_is_said() {
        let a = DMatrix::from_row_slice(3, 2, &[1.0, 1.0, 2.0, 2.0, 3.0, 3.0]);
        assert_eq!(unbounded(&a, &DVector::from_vec(vec![1.0, 2.0, 3.0])), None);
    }
}
