//! One step of the covariances of eqs. 10, 11 and 14, for several candidates side by side.
//!
//! Everything is in the grid's axes (the trace does not mind), where the information field is stored.
//! Each lane holds one candidate and no lane reads another, so a cost does not depend on which
//! candidates happen to share the registers.

use nalgebra::Matrix3;

use crate::evaluation::cpc::information_field::Factor;
use crate::evaluation::cpc::lqr::FeedbackGains;
use crate::motion::OdometryNoise;

/// Candidates that are computed together: enough for vector registers and for independent work.
pub(super) const LANES: usize = 8;

/// One number of each lane.
type Lanes = [f64; LANES];

/// A symmetric 3x3 matrix over (x, y, heading): xx, xy, yy, xt, yt, tt.
#[derive(Debug, Clone, Copy)]
struct Symmetric([f64; 6]);

/// What one step of one candidate does to its covariances.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// Sine and cosine of the heading half way through the step, in the grid's axes.
    pub(super) sin_cos: (f64, f64),
    /// Metres driven and radians turned.
    pub(super) travel: f64,
    pub(super) turn: f64,
    /// Feedback of the step's speed.
    pub(super) gains: FeedbackGains,
    /// Information of a scan taken at its end.
    pub(super) information: Factor,
}

/// The steps of all lanes, as arrays.
#[derive(Debug, Clone)]
pub(super) struct Steps {
    sin: Lanes,
    cos: Lanes,
    travel: Lanes,
    turn: Lanes,
    gains: [Lanes; 3],
    information: [Lanes; 6],
}

impl Steps {
    pub(super) const fn new() -> Self {
        const ZERO: Lanes = [0.0; LANES];
        Self { sin: ZERO, cos: ZERO, travel: ZERO, turn: ZERO, gains: [ZERO; 3], information: [ZERO; 6] }
    }

    #[inline(always)]
    pub(super) fn set(&mut self, lane: usize, step: &Step) {
        (self.sin[lane], self.cos[lane]) = step.sin_cos;
        self.travel[lane] = step.travel;
        self.turn[lane] = step.turn;
        self.gains[0][lane] = step.gains.along;
        self.gains[1][lane] = step.gains.across;
        self.gains[2][lane] = step.gains.heading;
        for (lanes, &value) in self.information.iter_mut().zip(&step.information) {
            lanes[lane] = value;
        }
    }

    #[inline(always)]
    fn at(&self, lane: usize) -> Step {
        let [along, across, heading] = std::array::from_fn(|i| self.gains[i][lane]);
        Step {
            sin_cos: (self.sin[lane], self.cos[lane]),
            travel: self.travel[lane],
            turn: self.turn[lane],
            gains: FeedbackGains { along, across, heading },
            information: std::array::from_fn(|i| self.information[i][lane]),
        }
    }
}

/// What does not change along a trajectory.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepModel {
    pub(super) noise: OdometryNoise,
    /// Seconds per step.
    pub(super) dt: f64,
    /// Updates of the localiser due per metre, per radian and per step (of time).
    pub(super) updates: (f64, f64, f64),
}

/// Sigma, Lambda and zeta of each lane.
#[derive(Debug, Clone)]
pub(super) struct Covariances {
    sigma: [Lanes; 6],
    lambda: [Lanes; 6],
    zeta: Lanes,
    due: Lanes,
}

impl Covariances {
    /// Every lane starts at `sigma`, the belief's covariance, and Lambda = 0.
    pub(super) fn new(sigma: &Matrix3<f64>) -> Self {
        let s = |r: usize, c: usize| [0.5 * (sigma[(r, c)] + sigma[(c, r)]); LANES];
        Self {
            sigma: [s(0, 0), s(0, 1), s(1, 1), s(0, 2), s(1, 2), s(2, 2)],
            lambda: [[0.0; LANES]; 6],
            zeta: [0.0; LANES],
            due: [0.0; LANES],
        }
    }

    /// `sum_k tr(Lambda_k + Sigma_k)` so far (eq. 15), m2 + rad2.
    pub(super) fn zeta(&self) -> &[f64; LANES] {
        &self.zeta
    }

    /// Drives every lane one step on. The body has no branch, so that it becomes vector code.
    #[inline(never)]
    pub(super) fn step(&mut self, model: &StepModel, steps: &Steps) {
        for lane in 0..LANES {
            let step = steps.at(lane);
            let (credit, due) = credit(self.due[lane], model, &step);
            self.due[lane] = due;
            let predicted = Symmetric::load(&self.sigma, lane).predict(model, &step);
            let updated = predicted.observe(&step.information, credit);
            let wander = Symmetric::load(&self.lambda, lane).steer(model.dt, &step);
            let wander = wander.zip(&predicted.zip(&updated, |p, u| p - u), |w, gained| w + gained);
            let ([wx, _, wy, .., wt], [ux, _, uy, .., ut]) = (wander.0, updated.0);
            self.zeta[lane] += wx + ux + (wy + uy) + (wt + ut);
            updated.store(&mut self.sigma, lane);
            wander.store(&mut self.lambda, lane);
        }
    }
}

/// 1 if the localiser updates during this step, else 0; and the share of the next update that is
/// already due (D5). One update at most per step.
#[inline(always)]
fn credit(due: f64, model: &StepModel, step: &Step) -> (f64, f64) {
    let (per_metre, per_radian, per_step) = model.updates;
    let (moved, turned) = (step.travel.abs() * per_metre, step.turn.abs() * per_radian);
    let faster = if moved > turned { moved } else { turned };
    let due = due + if faster > per_step { faster } else { per_step };
    // A sum of tenths may fall short of one by its rounding.
    let credit = if due >= 1.0 - 1e-9 { 1.0 } else { 0.0 };
    let left = due - credit;
    (credit, if left < 1.0 { left } else { 1.0 })
}

impl Symmetric {
    #[inline(always)]
    fn load(from: &[Lanes; 6], lane: usize) -> Self {
        Self(std::array::from_fn(|i| from[i][lane]))
    }

    #[inline(always)]
    fn store(&self, to: &mut [Lanes; 6], lane: usize) {
        for (lanes, value) in to.iter_mut().zip(self.0) {
            lanes[lane] = value;
        }
    }

    #[inline(always)]
    fn zip(&self, other: &Self, with: impl Fn(f64, f64) -> f64) -> Self {
        Self(std::array::from_fn(|i| with(self.0[i], other.0[i])))
    }

    /// Eq. 10: `A Sigma A^T + M'` with A = I but for its last column (-travel sin, travel cos, 1).
    #[inline(always)]
    fn predict(&self, model: &StepModel, step: &Step) -> Self {
        let Self([xx, xy, yy, xt, yt, tt]) = *self;
        let (sin, cos) = step.sin_cos;
        let (a, b) = (-step.travel * sin, step.travel * cos);
        let noise = model.noise.variances(step.travel, step.turn);
        Self([
            xx + a * (2.0 * xt + a * tt) + noise.x,
            xy + b * xt + a * yt + a * b * tt,
            yy + b * (2.0 * yt + b * tt) + noise.y,
            xt + a * tt,
            yt + b * tt,
            tt + noise.z,
        ])
    }

    /// Eq. 11, `(Sigma^-1 + J)^-1` without either inverse: three scalar Kalman updates, one for each
    /// column of J's factor. Needs no regular Sigma, and keeps it positive semi-definite.
    #[inline(always)]
    fn observe(&self, &[d1, l21, l31, d2, l32, d3]: &Factor, credit: f64) -> Self {
        let Self([xx, xy, yy, xt, yt, tt]) = *self;
        let (u, v, w) = (xx + l21 * xy + l31 * xt, xy + l21 * yy + l31 * yt, xt + l21 * yt + l31 * tt);
        let s = self.less(u, v, w, credit * d1 / (1.0 + credit * d1 * (u + l21 * v + l31 * w)));
        let Self([_, xy, yy, xt, yt, tt]) = s;
        let (u, v, w) = (xy + l32 * xt, yy + l32 * yt, yt + l32 * tt);
        let s = s.less(u, v, w, credit * d2 / (1.0 + credit * d2 * (v + l32 * w)));
        let Self([.., xt, yt, tt]) = s;
        s.less(xt, yt, tt, credit * d3 / (1.0 + credit * d3 * tt))
    }

    /// `self - g (u, v, w) (u, v, w)^T`.
    #[inline(always)]
    fn less(&self, u: f64, v: f64, w: f64, g: f64) -> Self {
        let (gu, gv, gw) = (g * u, g * v, g * w);
        let outer = Self([gu * u, gu * v, gv * v, gu * w, gv * w, gw * w]);
        self.zip(&outer, |s, o| s - o)
    }

    /// `(A - BK) Lambda (A - BK)^T` of eq. 14: in the path frame, where A - BK has five entries.
    #[inline(always)]
    fn steer(&self, dt: f64, step: &Step) -> Self {
        let (sin, cos) = step.sin_cos;
        let Self([xx, xy, yy, xt, yt, tt]) = self.turned(-sin, cos);
        // [[f, 0, 0], [0, 1, travel], [0, h, g]]
        let (f, g, h) = (1.0 - dt * step.gains.along, 1.0 - dt * step.gains.heading, -dt * step.gains.across);
        let (new_yt, new_tt) = (yt + step.travel * tt, g * tt);
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
    fn turned(&self, sin: f64, cos: f64) -> Self {
        let Self([xx, xy, yy, xt, yt, tt]) = *self;
        let (ss, sc, cc) = (sin * sin, sin * cos, cos * cos);
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
