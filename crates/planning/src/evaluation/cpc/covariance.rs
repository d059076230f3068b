//! One step of the covariances of eqs. 10, 11 and 14, for several candidates side by side.
//!
//! Everything is in the grid's axes (the trace does not mind), where the information field is stored.
//! Each lane holds one candidate and no lane reads another, so a cost does not depend on which
//! candidates happen to share the registers.

use nalgebra::Matrix3;

use crate::lanes::{Select, Simd, SimdBase, f64x8, greater};
use crate::motion::OdometryNoise;

/// A symmetric 3x3 matrix over (x, y, heading) in each lane: xx, xy, yy, xt, yt, tt.
#[derive(Clone, Copy)]
struct Symmetric<S: Simd>([f64x8<S>; 6]);

/// What one step of each candidate does to its covariances.
#[derive(Clone, Copy)]
pub(super) struct Step<S: Simd> {
    /// Sine and cosine of the heading half way through the step, in the grid's axes.
    pub(super) sin_cos: (f64x8<S>, f64x8<S>),
    /// Metres driven and radians turned.
    pub(super) travel: f64x8<S>,
    pub(super) turn: f64x8<S>,
    /// Feedback of the step's speed: along, across, heading.
    pub(super) gains: [f64x8<S>; 3],
    /// Information of a scan taken at its end.
    pub(super) information: [f64x8<S>; 6],
}

/// What does not change along a trajectory.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepModel {
    pub(super) noise: OdometryNoise,
    /// Seconds per step.
    pub(super) dt: f64,
    /// Updates of the localiser due per metre, per radian and per step (of time).
    pub(super) updates: (f64, f64, f64),
    /// What an update that time alone makes due is worth, as a share of one after motion.
    pub(super) rest_credit: f64,
    /// One through the trace of which half counts, 1/(m2 + rad2); zero if all of it does.
    pub(super) temper: f64,
}

/// Sigma, Lambda and zeta of each lane.
#[derive(Clone, Copy)]
pub(super) struct Covariances<S: Simd> {
    sigma: Symmetric<S>,
    lambda: Symmetric<S>,
    /// `sum_k tr(Lambda_k + Sigma_k)` so far (eq. 15), m2 + rad2.
    pub(super) zeta: f64x8<S>,
    /// Shares of the next update that motion and time have made due.
    moved: f64x8<S>,
    waited: f64x8<S>,
}

impl<S: Simd> Covariances<S> {
    /// Every lane starts at `sigma`, the belief's covariance, and Lambda = 0.
    #[inline(always)]
    pub(super) fn new(simd: S, sigma: &Matrix3<f64>) -> Self {
        let s = |r: usize, c: usize| f64x8::splat(simd, 0.5 * (sigma[(r, c)] + sigma[(c, r)]));
        let zero = f64x8::splat(simd, 0.0);
        Self {
            sigma: Symmetric([s(0, 0), s(0, 1), s(1, 1), s(0, 2), s(1, 2), s(2, 2)]),
            lambda: Symmetric([zero; 6]),
            zeta: zero,
            moved: zero,
            waited: zero,
        }
    }

    /// Sigma of one lane.
    #[inline(always)]
    pub(super) fn sigma_of(&self, lane: usize) -> Matrix3<f64> {
        let [xx, xy, yy, xt, yt, tt] = self.sigma.0.map(|of| of[lane]);
        Matrix3::new(xx, xy, xt, xy, yy, yt, xt, yt, tt)
    }

    /// Drives every lane one step on.
    #[inline(always)]
    pub(super) fn step(&mut self, model: &StepModel, step: &Step<S>) {
        let credit = self.credit(model, step);
        let predicted = self.sigma.predict(model, step);
        let updated = predicted.observe(&step.information, credit);
        let wander = self.lambda.steer(model.dt, step).plus(predicted.minus(updated));
        let ([wx, _, wy, .., wt], [ux, _, uy, .., ut]) = (wander.0, updated.0);
        let trace = wx + ux + (wy + uy) + (wt + ut);
        self.zeta += trace / (trace * model.temper + 1.0);
        (self.sigma, self.lambda) = (updated, wander);
    }

    /// What the scans of this step are worth: nothing unless the localiser updates, one for each update that motion has
    /// made due, and less where time alone does, because scans from one place repeat the same errors (D5).
    #[inline(always)]
    fn credit(&mut self, model: &StepModel, step: &Step<S>) -> f64x8<S> {
        let (per_metre, per_radian, per_step) = model.updates;
        let all = |x: f64| f64x8::splat(step.travel.simd, x);
        let zero = all(0.0);
        let one = all(1.0);
        let moved = self.moved + greater(step.travel.abs() * per_metre, step.turn.abs() * per_radian);
        let waited = self.waited + per_step;
        // A sum of tenths may fall short of one by its rounding.
        let is_due = greater(moved, waited).simd_ge(1.0 - 1e-9);
        self.moved = is_due.select(zero, moved);
        self.waited = is_due.select(greater(waited - one, zero), waited);
        is_due.select(greater(moved, all(model.rest_credit)), zero)
    }
}

impl<S: Simd> Symmetric<S> {
    #[inline(always)]
    fn plus(self, Self([a, b, c, d, e, f]): Self) -> Self {
        let Self([xx, xy, yy, xt, yt, tt]) = self;
        Self([xx + a, xy + b, yy + c, xt + d, yt + e, tt + f])
    }

    #[inline(always)]
    fn minus(self, Self([a, b, c, d, e, f]): Self) -> Self {
        let Self([xx, xy, yy, xt, yt, tt]) = self;
        Self([xx - a, xy - b, yy - c, xt - d, yt - e, tt - f])
    }

    /// Eq. 10: `A Sigma A^T + M'` with A = I but for its last column (-travel sin, travel cos, 1), and the variances of
    /// [`OdometryNoise::variances`].
    #[inline(always)]
    fn predict(self, model: &StepModel, step: &Step<S>) -> Self {
        let Self([xx, xy, yy, xt, yt, tt]) = self;
        let (sin, cos) = step.sin_cos;
        let a = -step.travel * sin;
        let b = step.travel * cos;
        let noise = &model.noise;
        let metres = step.travel.abs();
        let radians = step.turn.abs();
        let position = noise.position_per_metre * metres + noise.position_per_radian * radians;
        let heading = noise.heading_per_metre * metres + noise.heading_per_radian * radians;
        Self([
            xx + a * (2.0 * xt + a * tt) + position,
            xy + b * xt + a * yt + a * b * tt,
            yy + b * (2.0 * yt + b * tt) + position,
            xt + a * tt,
            yt + b * tt,
            tt + heading,
        ])
    }

    /// Eq. 11, `(Sigma^-1 + J)^-1` without either inverse: three scalar Kalman updates, one for each
    /// column of J's factor. Needs no regular Sigma, and keeps it positive semi-definite.
    #[inline(always)]
    fn observe(self, &[d1, l21, l31, d2, l32, d3]: &[f64x8<S>; 6], credit: f64x8<S>) -> Self {
        let Self([xx, xy, yy, xt, yt, tt]) = self;
        let u = xx + l21 * xy + l31 * xt;
        let v = xy + l21 * yy + l31 * yt;
        let w = xt + l21 * yt + l31 * tt;
        let s = self.less(u, v, w, credit * d1 / (1.0 + credit * d1 * (u + l21 * v + l31 * w)));
        let Self([_, xy, yy, xt, yt, tt]) = s;
        let u = xy + l32 * xt;
        let v = yy + l32 * yt;
        let w = yt + l32 * tt;
        let s = s.less(u, v, w, credit * d2 / (1.0 + credit * d2 * (v + l32 * w)));
        let Self([.., xt, yt, tt]) = s;
        s.less(xt, yt, tt, credit * d3 / (1.0 + credit * d3 * tt))
    }

    /// `self - g (u, v, w) (u, v, w)^T`.
    #[inline(always)]
    fn less(self, u: f64x8<S>, v: f64x8<S>, w: f64x8<S>, g: f64x8<S>) -> Self {
        let gu = g * u;
        let gv = g * v;
        let gw = g * w;
        self.minus(Self([gu * u, gu * v, gv * v, gu * w, gv * w, gw * w]))
    }

    /// `(A - BK) Lambda (A - BK)^T` of eq. 14: in the path frame, where A - BK has five entries.
    #[inline(always)]
    fn steer(self, dt: f64, step: &Step<S>) -> Self {
        let (sin, cos) = step.sin_cos;
        let Self([xx, xy, yy, xt, yt, tt]) = self.turned(-sin, cos);
        // [[f, 0, 0], [0, 1, travel], [0, h, g]]
        let [along, across, heading] = step.gains;
        let f = 1.0 - dt * along;
        let g = 1.0 - dt * heading;
        let h = -dt * across;
        let new_yt = yt + step.travel * tt;
        let new_tt = g * tt;
        Self([
            f * f * xx,
            f * (xy + step.travel * xt),
            yy + step.travel * (yt + new_yt),
            f * (h * xy + g * xt),
            h * (yy + step.travel * yt) + g * new_yt,
            h * (h * yy + 2.0 * g * yt) + g * new_tt,
        ])
        .turned(sin, cos)
    }

    /// `R Sigma R^T` with R the turn by the angle of the given sine and cosine.
    #[inline(always)]
    fn turned(self, sin: f64x8<S>, cos: f64x8<S>) -> Self {
        let Self([xx, xy, yy, xt, yt, tt]) = self;
        let ss = sin * sin;
        let sc = sin * cos;
        let cc = cos * cos;
        let twice = 2.0 * sc * xy;
        Self([
            cc * xx - twice + ss * yy,
            sc * (xx - yy) + (cc - ss) * xy,
            ss * xx + twice + cc * yy,
            cos * xt - sin * yt,
            sin * xt + cos * yt,
            tt,
        ])
    }
}
