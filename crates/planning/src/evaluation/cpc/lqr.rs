//! The feedback gain `K` of eqs. 12 and 14, which the paper leaves open (A3): the infinite-horizon
//! discrete LQR of the unicycle linearised about its nominal motion, with Q and R the identity.
//!
//! In the path frame (along, across, heading) the linearised unicycle falls apart into a scalar
//! integrator along the path and a double integrator across it. So K has three entries that are not
//! zero, and in another frame it only turns: `K(heading) = K R(-heading)`.

use nalgebra::{Matrix2, Vector2};

use crate::lanes::{LANES, Simd, SimdBase, f64x8, floor, greater, indices, lesser};

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
pub(super) struct GainTable {
    /// Those at the slower end of each interval and what they grow by to the other: along, across, heading.
    intervals: Vec<[[f64; 3]; 2]>,
}

impl GainTable {
    /// Solves the LQR from 0.1 to 2 m/s, every 0.05 m/s, for steps of `dt` seconds.
    pub(super) fn new(dt: f64) -> Self {
        let entries = ((FASTEST - SLOWEST) / SPACING).round() as usize + 1;
        let gains = |i: usize| {
            let FeedbackGains { along, across, heading } = lqr(SLOWEST + i as f64 * SPACING, dt);
            [along, across, heading]
        };
        let gains: Vec<[f64; 3]> = (0..entries).map(gains).collect();
        let interval = |pair: &[[f64; 3]]| [pair[0], std::array::from_fn(|i| pair[1][i] - pair[0][i])];
        Self { intervals: gains.windows(2).map(interval).collect() }
    }

    /// Gains along, across and of the heading at speed `v` m/s, clamped to the table.
    #[inline(always)]
    pub(super) fn at<S: Simd>(&self, v: f64x8<S>) -> [f64x8<S>; 3] {
        let most = self.intervals.len() as f64;
        let u = (v - SLOWEST) * (1.0 / SPACING);
        let u = lesser(greater(u, f64x8::splat(v.simd, 0.0)), f64x8::splat(v.simd, most));
        let i = lesser(floor(u), f64x8::splat(v.simd, most - 1.0));
        let f = u - i;
        let at = indices(i);
        let rows: [&[[f64; 3]; 2]; LANES] = std::array::from_fn(|lane| &self.intervals[at[lane]]);
        [between(rows, 0, f), between(rows, 1, f), between(rows, 2, f)]
    }
}

/// One of the gains of each row, the share `f` of the way to the other end.
#[inline(always)]
fn between<S: Simd>(rows: [&[[f64; 3]; 2]; LANES], gain: usize, f: f64x8<S>) -> f64x8<S> {
    let low = f64x8::from_fn(f.simd, |lane| rows[lane][0][gain]);
    low + f * f64x8::from_fn(f.simd, |lane| rows[lane][1][gain])
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::lanes::{Level, dispatch};

    /// No feedback at all, `K = 0`: the case in which observations cannot matter.
    pub(in crate::evaluation::cpc) fn without_feedback() -> GainTable {
        GainTable { intervals: vec![[[0.0; 3]; 2]] }
    }

    /// Gains at one speed.
    pub(in crate::evaluation::cpc) fn at(table: &GainTable, v: f64) -> FeedbackGains {
        let gains =
            dispatch!(Level::baseline(), simd => table.at(f64x8::splat(simd, v)).map(|lanes| lanes[0]));
        FeedbackGains { along: gains[0], across: gains[1], heading: gains[2] }
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
        let trace = 2.0 - 0.3 * k.heading;
        let determinant = 1.0 - 0.3 * k.heading + 0.27 * 0.3 * k.across;
        assert!(trace * trace < 4.0 * determinant, "not a complex pair");
        assert!((determinant.sqrt() - 0.778).abs() < 5e-4);
    }

    #[test]
    fn doubling_ends_where_plain_iteration_ends() {
        for (v, dt) in [(0.1, 0.3), (0.5, 0.1), (1.0, 0.3), (2.0, 0.05)] {
            let a = Matrix2::new(1.0, v * dt, 0.0, 1.0);
            let b = Vector2::new(0.0, dt);
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
                let k = lqr(v, dt);
                let travel = v.max(SLOWEST) * dt;
                let trace = 2.0 - dt * k.heading;
                let determinant = 1.0 - dt * k.heading + travel * dt * k.across;
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
            let near = at(&table, v);
            let exact = lqr(v, 0.3);
            assert!((near.across / exact.across - 1.0).abs() < 5e-3, "{v}");
            assert!((near.heading / exact.heading - 1.0).abs() < 5e-3, "{v}");
            assert!((near.along - exact.along).abs() < 1e-12);
        }
        assert_eq!(at(&table, 5.0), at(&table, 2.0));
        assert_eq!(at(&table, -1.0), at(&table, 0.1));
    }
}
