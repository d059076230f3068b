//! Transcendental functions that give the same bits on every machine.
//!
//! The system's own vary with processor and version, and one different last bit can change a
//! decision; so everything that feeds a decision calls these (D18 in `docs/methods.md`).

pub use libm::{asin, atan2, erf, exp, log as ln, sincos as sin_cos};

/// Length of the vector (x, y).
pub fn hypot(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// Eigenvalues of the symmetric matrix ((a, b), (b, c)), the greater first.
pub fn eigenvalues(a: f64, b: f64, c: f64) -> (f64, f64) {
    let (mean, root) = (0.5 * (a + c), hypot(0.5 * (a - c), b));
    (mean + root, mean - root)
}
