//! Curiosity for Positive Content (CPC): how uncertain the robot would be along a candidate
//! (section IV-B, eqs. 7 to 15).
//!
//! The pose error is propagated as in the rapidly-exploring random belief tree (Bry and Roy, 2011). `Sigma` is the
//! covariance of the truth around the estimate: what the filter will not know. `Lambda` is the covariance of the
//! estimate around the candidate: how far the robot will believe itself to be off its way. Along the candidate
//! ```text
//! Sigma_bar = A Sigma A^T + M'                                    (10)
//! Sigma     = Sigma_bar - L C Sigma_bar                           (11)
//! Lambda    = (A - B K) Lambda (A - B K)^T + L C Sigma_bar        (14)
//! zeta      = sum_k tr(Lambda_k + Sigma_k)                        (15)
//! ```
//! with `Sigma_0` the belief's covariance and `Lambda_0 = 0` (A7). `A` and `M'` are the linearised motion and its
//! noise. `C` is the linearised measurement, which [`InformationField`] gives, and `L` the Kalman gain. `K` is the
//! feedback gain of the controller, which [`lqr`] gives. With `K = 0` the sum `Lambda + Sigma` would be the same
//! whatever is observed, and landmarks would not matter.
//!
//! People hide no landmark from `cpc`, as in the paper (A32); from `cpc-occluded` they do ([`CpcOccludedEvaluator`]).
//! `docs/methods.md` says what A7, A32 and the like stand for.

mod beam_fan;
mod covariance;
mod information_field;
pub mod lqr;
mod occluded;
mod ray_field;
mod wall_normals;

use std::sync::Arc;

use nalgebra::Matrix3;

use crate::candidates::CandidateSet;
use crate::evaluation::{Costs, Evaluator, Stopped, temper};
use crate::lanes::{LANES, Level, Simd, SimdBase, dispatch, f64x8, sin_cos};
use crate::motion::OdometryNoise;
use crate::parameters::Range;
use crate::scene::Scene;

pub use beam_fan::MeasurementModel;
use covariance::{Covariances, Step, StepModel};
pub use information_field::{InformationField, InformationParams};
use lqr::GainTable;
pub use occluded::CpcOccludedEvaluator;
pub use ray_field::RayField;

crate::parameters! {
    /// When the prediction takes an observation into account: only where the localiser would update (D5). These are the
    /// localiser's own thresholds.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct CpcParams {
        /// Metres driven between two updates. A step in which twice as much is driven counts as two updates.
        pub update_min_d: f64 [0.0, 100.0, "m", "a localiser that updates more rarely does not localise"] = 0.2,
        /// Radians turned between two updates.
        pub update_min_a: f64
            [0.0, 100.0, "rad", "a localiser that updates more rarely does not localise"] = std::f64::consts::FRAC_PI_6,
        /// Seconds between two updates at rest (D7).
        pub update_max_interval: f64 [
            0.01, 1000.0, "s", "a scan comes at most a hundred times per second, and updates are no rarer than that"
        ] = 1.0,
        /// What a scan at rest is worth, as a share of one after motion: the localiser's `rest_temper`. After slow
        /// motion it is the share of `update_min_d` or `update_min_a` that has been moved, if that is more.
        pub rest_credit: f64 [in Range::SHARE] = 0.02,
        /// Trace of which half counts, m2 + rad2: a trace l counts as l / (1 + l / saturation). To a robot that is
        /// lost, more uncertainty hardly counts, so it drives on. At 0 all of it counts, as in the paper.
        pub saturation: f64 [0.0, 1e6, "m2 + rad2", "no filter is that uncertain"] = 0.0,
    }
}

/// Term `cpc`: zeta of eq. 15, m2 + rad2 (A8).
#[derive(Debug, Clone)]
pub struct CpcEvaluator {
    field: Arc<InformationField>,
    noise: OdometryNoise,
    params: CpcParams,
}

impl CpcEvaluator {
    /// Evaluates on the map and laser of `field`, with the odometry noise that plant and localiser share.
    pub fn new(field: Arc<InformationField>, noise: OdometryNoise, params: CpcParams) -> Self {
        Self { field, noise, params }
    }

    /// What the localiser is predicted to know along candidate `index`: `Sigma` of eq. 11 after each state, map frame.
    /// `sigma` is the belief's covariance.
    pub fn predicted(
        &self,
        sigma: &Matrix3<f64>,
        candidates: &CandidateSet,
        index: usize,
    ) -> Vec<Matrix3<f64>> {
        let mut predicted = Vec::new();
        let alone = candidates.pick([index]);
        let found = self.along(sigma, &alone, &|| false, |_, sigmas| predicted = sigmas.to_vec());
        debug_assert_eq!(found, Ok(()));
        predicted
    }

    /// Calls `each` for all candidates, with the index and the covariances of [`Self::predicted`].
    pub(super) fn along(
        &self,
        sigma: &Matrix3<f64>,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
        each: impl FnMut(usize, &[Matrix3<f64>]),
    ) -> Result<(), Stopped> {
        self.along_with(&*self.field, sigma, candidates, should_stop, each)
    }

    /// [`Self::along`] for scans that tell what `observation` says, instead of the field.
    fn along_with(
        &self,
        observation: &impl Observation,
        sigma: &Matrix3<f64>,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
        mut each: impl FnMut(usize, &[Matrix3<f64>]),
    ) -> Result<(), Stopped> {
        let turn = self.field.map_from_grid();
        let gains = GainTable::new(candidates.dt());
        let drive = self.drive(observation, sigma, &gains, candidates);
        let mut sigmas: [_; LANES] = std::array::from_fn(|_| Vec::with_capacity(candidates.steps()));
        for first in (0..candidates.len()).step_by(LANES) {
            if should_stop() {
                return Err(Stopped);
            }
            sigmas.iter_mut().for_each(Vec::clear);
            dispatch!(Level::new(), simd => drive.sigmas(simd, first, &mut sigmas));
            for (lane, sigmas) in sigmas.iter_mut().enumerate().take(candidates.len() - first) {
                sigmas.iter_mut().for_each(|sigma| *sigma = turn * *sigma * turn.transpose());
                each(first + lane, sigmas);
            }
        }
        Ok(())
    }

    fn drive<'a, O: Observation>(
        &'a self,
        observation: &'a O,
        sigma: &Matrix3<f64>,
        gains: &'a GainTable,
        candidates: &'a CandidateSet,
    ) -> Drive<'a, O> {
        let turn = self.field.map_from_grid();
        let grid_heading = self.field.grid_heading();
        let sigma = turn.transpose() * sigma * turn;
        Drive { observation, grid_heading, gains, model: self.step_model(candidates.dt()), sigma, candidates }
    }

    /// The costs for scans that tell what `observation` says, and for the feedback `gains`. The costs are the same for
    /// every `level` of vector instructions.
    fn evaluate_with(
        &self,
        observation: &impl Observation,
        gains: &GainTable,
        level: Level,
        scene: &Scene,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
    ) -> Costs {
        let drive = self.drive(observation, &scene.belief.covariance, gains, candidates);
        let mut costs = Vec::with_capacity(candidates.len());
        for first in (0..candidates.len()).step_by(LANES) {
            if should_stop() {
                return Err(Stopped);
            }
            let zeta = dispatch!(level, simd => drive.zeta(simd, first));
            costs.extend(zeta.iter().take(candidates.len() - first));
        }
        Ok(costs)
    }

    /// The costs, computed with the vector instructions of `level`.
    pub(super) fn evaluate_at(
        &self,
        level: Level,
        scene: &Scene,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
    ) -> Costs {
        let gains = GainTable::new(candidates.dt());
        self.evaluate_with(&*self.field, &gains, level, scene, candidates, should_stop)
    }

    fn step_model(&self, dt: f64) -> StepModel {
        // A threshold of zero asks for an update every step.
        let rate = |threshold: f64| 1.0 / threshold.max(1e-6);
        let CpcParams { update_min_d, update_min_a, update_max_interval, rest_credit, saturation } =
            self.params;
        let temper = temper(saturation);
        let updates = (rate(update_min_d), rate(update_min_a), dt * rate(update_max_interval));
        StepModel { noise: self.noise, dt, updates, rest_credit, temper }
    }
}

/// What a scan tells.
trait Observation {
    /// Information about the robot's pose after step number `step`, in the grid's axes. The eight lanes are eight
    /// candidates. The matrix is given as d1, l21, l31, d2, l32, d3 of its LDL decomposition.
    fn factors_at<S: Simd>(&self, step: usize, x: f64x8<S>, y: f64x8<S>, heading: f64x8<S>) -> [f64x8<S>; 6];
}

impl Observation for InformationField {
    #[inline(always)]
    fn factors_at<S: Simd>(&self, _: usize, x: f64x8<S>, y: f64x8<S>, heading: f64x8<S>) -> [f64x8<S>; 6] {
        self.factors_at(x, y, heading)
    }
}

/// What all candidates of a batch have in common.
struct Drive<'a, O> {
    observation: &'a O,
    /// Heading of the grid's first axis, radians.
    grid_heading: f64,
    gains: &'a GainTable,
    model: StepModel,
    /// The belief's covariance in the grid's axes.
    sigma: Matrix3<f64>,
    candidates: &'a CandidateSet,
}

/// The states of eight candidates: x, y, heading, v and omega, each `[lane][step]`.
type Rows<'a> = [[&'a [f64]; LANES]; 5];

impl<O: Observation> Drive<'_, O> {
    /// The candidates from `first` on. The last group is filled up with copies of the last candidate.
    fn rows(&self, first: usize) -> Rows<'_> {
        let set = self.candidates;
        let states = self.candidates.all_states();
        let rows: [_; LANES] = std::array::from_fn(|lane| set.range((first + lane).min(set.len() - 1)));
        [&states.x, &states.y, &states.heading, &states.v, &states.omega]
            .map(|of| rows.each_ref().map(|row| &of[row.clone()]))
    }

    /// Zeta of the candidates from `first` on, side by side.
    #[inline(always)]
    fn zeta<S: Simd>(&self, simd: S, first: usize) -> [f64; LANES] {
        let rows = self.rows(first);
        let mut covariances = Covariances::new(simd, &self.sigma);
        for k in 0..self.candidates.steps() {
            covariances.step(&self.model, &self.step(simd, &rows, k));
        }
        covariances.zeta.into()
    }

    /// Adds Sigma after each state of the candidates from `first` on, in the grid's axes, one list per candidate.
    #[inline(always)]
    fn sigmas<S: Simd>(&self, simd: S, first: usize, into: &mut [Vec<Matrix3<f64>>]) {
        let rows = self.rows(first);
        let mut covariances = Covariances::new(simd, &self.sigma);
        for k in 0..self.candidates.steps() {
            covariances.step(&self.model, &self.step(simd, &rows, k));
            into.iter_mut().enumerate().for_each(|(lane, sigmas)| sigmas.push(covariances.sigma_of(lane)));
        }
    }

    /// What step `k` does.
    #[inline(always)]
    fn step<S: Simd>(&self, simd: S, [x, y, heading, v, omega]: &Rows<'_>, k: usize) -> Step<S> {
        let lanes = |of: &[&[f64]; LANES]| f64x8::from_fn(simd, |lane| of[lane][k]);
        let heading = lanes(heading);
        let v = lanes(v);
        let dt = self.candidates.dt();
        let travel = v * dt;
        let turn = lanes(omega) * dt;
        // The motion is linearised at the heading half way through the step, which is that of the arc's chord. This is
        // more exact than at the heading of its start (Euler), and needs no state between the two.
        let chord = heading - self.grid_heading - 0.5 * turn;
        Step {
            sin_cos: sin_cos(chord),
            travel,
            turn,
            gains: self.gains.at(v),
            information: self.observation.factors_at(k, lanes(x), lanes(y), heading),
        }
    }
}

impl Evaluator for CpcEvaluator {
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        self.evaluate_at(Level::new(), scene, candidates, should_stop)
    }
}

#[cfg(test)]
mod reference_tests;
#[cfg(test)]
pub(super) mod tests;
