//! Transcendental functions that give the same bits on every machine.
//!
//! The system's own vary with processor and version, and one different last bit can change a
//! decision; so everything that feeds a decision calls these (D18 in `docs/methods.md`).

use std::ops::{Add, Mul};

pub use libm::{asin, atan2, erf, exp, log as ln, sincos as sin_cos};

/// Greatest angle that [`sinc_cos`] takes, radians.
pub const SMALL_ANGLE: f64 = 0.5;

/// `sin(x) / x` and `cos(x)` for |x| <= [`SMALL_ANGLE`] only, by their Taylor series, to 1e-16; of a number or of
/// lanes.
#[inline(always)]
pub fn sinc_cos<T: Copy + Mul<Output = T> + Mul<f64, Output = T> + Add<f64, Output = T>>(x: T) -> (T, T) {
    const S: [f64; 6] =
        [-1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0, -1.0 / 39_916_800.0, 1.0 / 6_227_020_800.0];
    const C: [f64; 7] = [
        -1.0 / 2.0,
        1.0 / 24.0,
        -1.0 / 720.0,
        1.0 / 40_320.0,
        -1.0 / 3_628_800.0,
        1.0 / 479_001_600.0,
        -1.0 / 87_178_291_200.0,
    ];
    let h = x * x;
    let mut sinc = h * S[5];
    for c in S[..5].iter().rev() {
        sinc = (sinc + *c) * h;
    }
    let mut cos = h * C[6];
    for c in C[..6].iter().rev() {
        cos = (cos + *c) * h;
    }
    (sinc + 1.0, cos + 1.0)
}

/// Length of the vector (x, y).
pub fn hypot(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// Eigenvalues of the symmetric matrix ((a, b), (b, c)), the greater first.
pub fn eigenvalues(a: f64, b: f64, c: f64) -> (f64, f64) {
    let mean = 0.5 * (a + c);
    let root = hypot(0.5 * (a - c), b);
    (mean + root, mean - root)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_angles_have_their_sine_and_cosine() {
        for i in -1000..=1000 {
            let x = SMALL_ANGLE * f64::from(i) / 1000.0;
            let (sinc, cos) = sinc_cos(x);
            let (sin, expected) = sin_cos(x);
            assert!((x * sinc - sin).abs() < 2e-16 && (cos - expected).abs() < 2e-16, "{x}");
        }
        assert_eq!(sinc_cos(0.0), (1.0, 1.0));
    }
}
