//! The feedback gain `K` of eqs. 12 and 14, which the paper leaves open (A3): the infinite-horizon
//! discrete LQR of the unicycle linearised about its nominal motion, with Q and R the identity.
//!
//! In the path frame (along, across, heading) the linearised unicycle falls apart into a scalar
//! integrator along the path and a double integrator across it. So K has three entries that are not
//! zero, and in another frame it only turns: `K(heading) = K R(-heading)`.

use nalgebra::{Matrix2, Vector2};

/// The entries of `K = [[along, 0, 0], [0, across, heading]]`: rows are speed and turn rate, columns
/// the error in the path frame.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FeedbackGains {
    /// Speed per metre of error along the path, 1/s.
    pub along: f64,
    /// Turn rate per metre of error across the path, rad/(m s).
    pub across: f64,
    /// Turn rate per radian of heading error, 1/s.
    pub heading: f64,
}

/// Slowest speed for which a gain is computed, m/s: at rest the error across the path cannot be
/// controlled and the Riccati equation has no solution.
pub const SLOWEST: f64 = 0.1;
/// Speed from which on the gain no longer changes, m/s: twice what the robot can do.
const FASTEST: f64 = 2.0;
/// Speed between two entries of the table, m/s: linear interpolation is then exact to 0.2 %.
const SPACING: f64 = 0.05;
/// Doublings: the 2^40th step of the Riccati recursion; it stands still after about ten.
const MAX_DOUBLINGS: usize = 40;

/// Solves the LQR at speed `v` (at least [`SLOWEST`]) and step `dt` seconds.
pub fn lqr(v: f64, dt: f64) -> FeedbackGains {
    let travel = v.max(SLOWEST) * dt;
    // Along: p^2 dt^2 = 1 + p dt^2, the scalar Riccati equation.
    let b = dt * dt;
    let p = 0.5 * (1.0 + (1.0 + 4.0 / b).sqrt());
    let along = dt * p / (1.0 + b * p);

    let a = Matrix2::new(1.0, travel, 0.0, 1.0);
    let p = riccati(a, Matrix2::new(0.0, 0.0, 0.0, b), Matrix2::identity());
    let row = Vector2::new(p[(1, 0)], p[(1, 1)]).transpose() * a * (dt / (1.0 + b * p[(1, 1)]));
    FeedbackGains { along, across: row[0], heading: row[1] }
}

/// Stabilising solution of the discrete algebraic Riccati equation with `g = B R^-1 B^T`, by the
/// structure-preserving doubling algorithm (Chu, Fan, Lin, Wang, 2004), quadratically convergent.
fn riccati(mut a: Matrix2<f64>, mut g: Matrix2<f64>, q: Matrix2<f64>) -> Matrix2<f64> {
    let mut p = q;
    for _ in 0..MAX_DOUBLINGS {
        let w = inverse(Matrix2::identity() + g * p) * a;
        let step = a.transpose() * p * w;
        let v = inverse(Matrix2::identity() + g * p) * g;
        g += a * v * a.transpose();
        a *= w;
        p += step;
        if step.norm() <= 1e-15 * p.norm() {
            break;
        }
    }
    p
}

/// Inverse of a matrix known to be regular (the identity plus a product of semi-definite ones).
fn inverse(m: Matrix2<f64>) -> Matrix2<f64> {
    Matrix2::new(m[(1, 1)], -m[(0, 1)], -m[(1, 0)], m[(0, 0)]) / m.determinant()
}

/// Gains over speed for one step length, linear in between.
#[derive(Debug, Clone)]
pub struct GainTable {
    gains: Vec<FeedbackGains>,
}

impl GainTable {
    /// Solves the LQR from 0.1 to 2 m/s, every 0.05 m/s, for steps of `dt` seconds.
    pub fn new(dt: f64) -> Self {
        let entries = ((FASTEST - SLOWEST) / SPACING).round() as usize + 1;
        Self { gains: (0..entries).map(|i| lqr(SLOWEST + i as f64 * SPACING, dt)).collect() }
    }

    /// Gains at speed `v` m/s, clamped to the table.
    #[inline]
    pub fn at(&self, v: f64) -> FeedbackGains {
        let last = self.gains.len() - 1;
        let u = ((v - SLOWEST) * (1.0 / SPACING)).clamp(0.0, last as f64);
        let i = (u as u32 as usize).min(last - 1);
        let (low, high, f) = (self.gains[i], self.gains[i + 1], u - i as f64);
        FeedbackGains {
            along: low.along + f * (high.along - low.along),
            across: low.across + f * (high.across - low.across),
            heading: low.heading + f * (high.heading - low.heading),
        }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    /// No feedback at all, `K = 0`: the case in which observations cannot matter.
    pub(in crate::evaluation::cpc) fn without_feedback() -> GainTable {
        GainTable { gains: vec![FeedbackGains { along: 0.0, across: 0.0, heading: 0.0 }; 2] }
    }

    #[test]
    fn the_gain_at_cruising_speed_is_the_published_one() {
        let k = lqr(0.9, 0.3);
        assert!((k.along - 0.861).abs() < 5e-4, "{k:?}");
        assert!((k.across - 0.778).abs() < 5e-4, "{k:?}");
        assert!((k.heading - 1.525).abs() < 5e-4, "{k:?}");
        // Closed loop: 1 - dt k along the path; a complex pair across it, whose modulus is the root
        // of the determinant of [[1, v dt], [-dt k2, 1 - dt k3]].
        assert!((1.0 - 0.3 * k.along - 0.742).abs() < 5e-4);
        let (trace, determinant) = (2.0 - 0.3 * k.heading, 1.0 - 0.3 * k.heading + 0.27 * 0.3 * k.across);
        assert!(trace * trace < 4.0 * determinant, "not a complex pair");
        assert!((determinant.sqrt() - 0.778).abs() < 5e-4);
    }

    #[test]
    fn doubling_ends_where_plain_iteration_ends() {
        for (v, dt) in [(0.1, 0.3), (0.5, 0.1), (1.0, 0.3), (2.0, 0.05)] {
            let (a, b) = (Matrix2::new(1.0, v * dt, 0.0, 1.0), Vector2::new(0.0, dt));
            let mut p = Matrix2::identity();
            let mut k = (b.transpose() * p * a) / (1.0 + (b.transpose() * p * b)[0]);
            for _ in 0..20_000 {
                p = Matrix2::identity() + a.transpose() * p * (a - b * k);
                k = (b.transpose() * p * a) / (1.0 + (b.transpose() * p * b)[0]);
            }
            let fast = lqr(v, dt);
            assert!((fast.across / k[0] - 1.0).abs() < 1e-9, "v {v} dt {dt}: {fast:?} vs {k}");
            assert!((fast.heading / k[1] - 1.0).abs() < 1e-9, "v {v} dt {dt}: {fast:?} vs {k}");
        }
    }

    #[test]
    fn the_closed_loop_is_stable_at_every_speed() {
        for dt in [0.05, 0.1, 0.3, 0.5] {
            for i in 0..=40 {
                let v = 0.05 * f64::from(i);
                let (k, travel) = (lqr(v, dt), v.max(SLOWEST) * dt);
                let (trace, determinant) =
                    (2.0 - dt * k.heading, 1.0 - dt * k.heading + travel * dt * k.across);
                // Jury's conditions for z^2 - trace z + determinant
                assert!(determinant < 1.0 && trace.abs() < 1.0 + determinant, "v {v} dt {dt}");
                assert!((1.0 - dt * k.along).abs() < 1.0);
            }
        }
    }

    #[test]
    fn the_table_is_within_half_a_percent_of_the_solution() {
        let table = GainTable::new(0.3);
        for i in 0..=200 {
            let v = 0.01 * f64::from(i);
            let (near, exact) = (table.at(v), lqr(v, 0.3));
            assert!((near.across / exact.across - 1.0).abs() < 5e-3, "{v}");
            assert!((near.heading / exact.heading - 1.0).abs() < 5e-3, "{v}");
            assert!((near.along - exact.along).abs() < 1e-12);
        }
        assert_eq!(table.at(5.0), table.at(2.0));
        assert_eq!(table.at(-1.0), table.at(0.1));
    }
}
