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

/// A symmetric 3x3 matrix over (x, y, heading).
#[derive(Debug, Clone, Copy)]
struct Symmetric {
    xx: f64,
    xy: f64,
    yy: f64,
    xt: f64,
    yt: f64,
    tt: f64,
}

/// What one step of one candidate does to its covariances.
#[derive(Debug, Clone, Copy)]
pub(super) struct Step {
    /// Sine and cosine of the heading half way through the step, in the grid's axes.
    pub(super) sin_cos: (f64, f64),
    /// Metres driven and radians turned.
    pub(super) travel: f64,
    /// See `travel`.
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
    /// All zero.
    pub(super) const fn new() -> Self {
        const ZERO: Lanes = [0.0; LANES];
        Self { sin: ZERO, cos: ZERO, travel: ZERO, turn: ZERO, gains: [ZERO; 3], information: [ZERO; 6] }
    }

    /// Puts one lane's step in its place.
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
        let gain = |i: usize| self.gains[i][lane];
        let information = |i: usize| self.information[i][lane];
        Step {
            sin_cos: (self.sin[lane], self.cos[lane]),
            travel: self.travel[lane],
            turn: self.turn[lane],
            gains: FeedbackGains { along: gain(0), across: gain(1), heading: gain(2) },
            information: [
                information(0),
                information(1),
                information(2),
                information(3),
                information(4),
                information(5),
            ],
        }
    }
}

/// What does not change along a trajectory.
#[derive(Debug, Clone, Copy)]
pub(super) struct StepModel {
    /// Process noise.
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
            let wander = wander.plus(&predicted.minus(&updated));
            self.zeta[lane] += wander.xx + updated.xx + (wander.yy + updated.yy) + (wander.tt + updated.tt);
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
        Self {
            xx: from[0][lane],
            xy: from[1][lane],
            yy: from[2][lane],
            xt: from[3][lane],
            yt: from[4][lane],
            tt: from[5][lane],
        }
    }

    #[inline(always)]
    fn store(&self, to: &mut [Lanes; 6], lane: usize) {
        to[0][lane] = self.xx;
        to[1][lane] = self.xy;
        to[2][lane] = self.yy;
        to[3][lane] = self.xt;
        to[4][lane] = self.yt;
        to[5][lane] = self.tt;
    }

    #[inline(always)]
    fn plus(&self, o: &Self) -> Self {
        Self {
            xx: self.xx + o.xx,
            xy: self.xy + o.xy,
            yy: self.yy + o.yy,
            xt: self.xt + o.xt,
            yt: self.yt + o.yt,
            tt: self.tt + o.tt,
        }
    }

    #[inline(always)]
    fn minus(&self, o: &Self) -> Self {
        Self {
            xx: self.xx - o.xx,
            xy: self.xy - o.xy,
            yy: self.yy - o.yy,
            xt: self.xt - o.xt,
            yt: self.yt - o.yt,
            tt: self.tt - o.tt,
        }
    }

    /// Eq. 10: `A Sigma A^T + M'` with A = I but for its last column (-travel sin, travel cos, 1).
    #[inline(always)]
    fn predict(&self, model: &StepModel, step: &Step) -> Self {
        let (sin, cos) = step.sin_cos;
        let (a, b) = (-step.travel * sin, step.travel * cos);
        let noise = model.noise.variances(step.travel, step.turn);
        Self {
            xx: self.xx + a * (2.0 * self.xt + a * self.tt) + noise.x,
            xy: self.xy + b * self.xt + a * self.yt + a * b * self.tt,
            yy: self.yy + b * (2.0 * self.yt + b * self.tt) + noise.y,
            xt: self.xt + a * self.tt,
            yt: self.yt + b * self.tt,
            tt: self.tt + noise.z,
        }
    }

    /// Eq. 11, `(Sigma^-1 + J)^-1` without either inverse: three scalar Kalman updates, one for each
    /// column of J's factor. Needs no regular Sigma, and keeps it positive semi-definite.
    #[inline(always)]
    fn observe(&self, &[d1, l21, l31, d2, l32, d3]: &Factor, credit: f64) -> Self {
        let s = self;
        let (u, v, w) =
            (s.xx + l21 * s.xy + l31 * s.xt, s.xy + l21 * s.yy + l31 * s.yt, s.xt + l21 * s.yt + l31 * s.tt);
        let s = s.less(u, v, w, credit * d1 / (1.0 + credit * d1 * (u + l21 * v + l31 * w)));
        let (u, v, w) = (s.xy + l32 * s.xt, s.yy + l32 * s.yt, s.yt + l32 * s.tt);
        let s = s.less(u, v, w, credit * d2 / (1.0 + credit * d2 * (v + l32 * w)));
        s.less(s.xt, s.yt, s.tt, credit * d3 / (1.0 + credit * d3 * s.tt))
    }

    /// `self - g (u, v, w) (u, v, w)^T`.
    #[inline(always)]
    fn less(&self, u: f64, v: f64, w: f64, g: f64) -> Self {
        let (gu, gv, gw) = (g * u, g * v, g * w);
        Self {
            xx: self.xx - gu * u,
            xy: self.xy - gu * v,
            yy: self.yy - gv * v,
            xt: self.xt - gu * w,
            yt: self.yt - gv * w,
            tt: self.tt - gw * w,
        }
    }

    /// `(A - BK) Lambda (A - BK)^T` of eq. 14: in the path frame, where A - BK has five entries.
    #[inline(always)]
    fn steer(&self, dt: f64, step: &Step) -> Self {
        let (sin, cos) = step.sin_cos;
        let p = self.turned(-sin, cos);
        // [[f, 0, 0], [0, 1, travel], [0, h, g]]
        let (f, g, h) = (1.0 - dt * step.gains.along, 1.0 - dt * step.gains.heading, -dt * step.gains.across);
        let (yt, tt) = (p.yt + step.travel * p.tt, g * p.tt);
        Self {
            xx: f * f * p.xx,
            xy: f * (p.xy + step.travel * p.xt),
            yy: p.yy + step.travel * (p.yt + yt),
            xt: f * (h * p.xy + g * p.xt),
            yt: h * (p.yy + step.travel * p.yt) + g * yt,
            tt: h * (h * p.yy + 2.0 * g * p.yt) + g * tt,
        }
        .turned(sin, cos)
    }

    /// `R Sigma R^T` with R the turn by the angle of the given sine and cosine.
    #[inline(always)]
    fn turned(&self, sin: f64, cos: f64) -> Self {
        let (ss, sc, cc) = (sin * sin, sin * cos, cos * cos);
        let twice = 2.0 * sc * self.xy;
        Self {
            xx: cc * self.xx - twice + ss * self.yy,
            xy: sc * (self.xx - self.yy) + (cc - ss) * self.xy,
            yy: ss * self.xx + twice + cc * self.yy,
            xt: cos * self.xt - sin * self.yt,
            yt: sin * self.xt + cos * self.yt,
            tt: self.tt,
        }
    }
}
