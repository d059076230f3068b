//! Transcendental functions that give the same bits on every machine.
//!
//! The system's own vary with processor and version, and one different last bit can change a
//! decision; so everything that feeds a decision calls these (D18 in `docs/methods.md`).

pub use libm::{asin, atan2, erf, exp, log as ln, sincos as sin_cos};

/// Natural exponential for -8.1 <= x <= 0 only, relative error below 1e-12 and exactly 1 at 0.
///
/// A Gaussian cut at four sigma needs no more (its argument is at least -4^2/2 = -8). Without branches,
/// tables or range reduction, so a loop over lanes becomes vector code: e^x = p(x)^128, with p the
/// degree-6 polynomial that equals e^(x/128) at 0 and at six Chebyshev nodes of the interval.
#[inline(always)]
pub fn exp_minus_8_to_0(x: f64) -> f64 {
    const C: [f64; 6] = [
        0.007812499999999952,
        3.051757812457803e-5,
        7.94728590923973e-8,
        1.5522010839637334e-10,
        2.424553896616902e-13,
        3.073578814104865e-16,
    ];
    let x2 = x * x;
    let (low, middle, high) = (1.0 + C[0] * x, C[1] + C[2] * x, C[3] + C[4] * x + C[5] * x2);
    let mut p = low + x2 * middle + (x2 * x2) * high;
    for _ in 0..7 {
        p *= p;
    }
    p
}

/// Length of the vector (x, y).
pub fn hypot(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// Eigenvalues of the symmetric matrix ((a, b), (b, c)), the greater first.
pub fn eigenvalues(a: f64, b: f64, c: f64) -> (f64, f64) {
    let (mean, root) = (0.5 * (a + c), hypot(0.5 * (a - c), b));
    (mean + root, mean - root)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_short_exponential_is_the_exponential_on_its_interval() {
        let n = 100_000;
        for i in 0..=n {
            let x = -8.1 * f64::from(i) / f64::from(n);
            let relative = exp_minus_8_to_0(x) / exp(x) - 1.0;
            assert!(relative.abs() < 1e-12, "{relative} at {x}");
        }
        assert_eq!(exp_minus_8_to_0(0.0), 1.0);
    }
}
