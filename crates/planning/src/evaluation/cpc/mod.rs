//! Curiosity for Positive Content (CPC): how uncertain the robot would be along a candidate
//! (section IV-B, eqs. 7 to 15).
//!
//! The pose error is propagated as in the rapidly-exploring random belief tree (Bry and Roy, 2011):
//! `Sigma` is what the filter will not know, `Lambda` the wander of the estimate about the nominal
//! trajectory that the controller has to remove. Along the candidate
//! ```text
//! Sigma_bar = A Sigma A^T + M'                                    (10)
//! Sigma     = Sigma_bar - L C Sigma_bar                           (11)
//! Lambda    = (A - B K) Lambda (A - B K)^T + L C Sigma_bar        (14)
//! zeta      = sum_k tr(Lambda_k + Sigma_k)                        (15)
//! ```
//! with `Sigma_0` the belief's covariance and `Lambda_0 = 0` (A7). Observations come from
//! [`InformationField`], the gain from [`lqr`]. With `K = 0` the sum `Lambda + Sigma` would not depend on
//! observations at all, and the term would be blind. People who hide landmarks are not modelled, as
//! in the paper (A32).

mod beam_fan;
mod covariance;
mod information_field;
pub mod lqr;
mod wall_normals;

use std::sync::Arc;

use nalgebra::Matrix3;

use crate::candidates::CandidateSet;
use crate::evaluation::{Costs, Evaluator, Stopped};
use crate::lanes::{LANES, Level, Simd, SimdBase, dispatch, f64x8, sin_cos};
use crate::motion::OdometryNoise;
use crate::scene::Scene;

pub use beam_fan::MeasurementModel;
use covariance::{Covariances, Step, StepModel};
pub use information_field::{InformationField, InformationParams};
use lqr::GainTable;

crate::parameters! {
    /// When an observation is credited: where the localiser would update (D5). These are the localiser's
    /// own thresholds.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct CpcParams {
        /// Metres driven between two updates. What is driven beyond it counts towards the next one.
        pub update_min_d: f64 [0.0, 100.0, "m", "a localiser that updates more rarely does not localise"] = 0.2,
        /// Radians turned between two updates.
        pub update_min_a: f64
            [0.0, 100.0, "rad", "a localiser that updates more rarely does not localise"] = std::f64::consts::FRAC_PI_6,
        /// Seconds between two updates at rest (D7).
        pub update_max_interval: f64 [
            0.01, 1000.0, "s", "a scan comes at most a hundred times per second, and updates are no rarer than that"
        ] = 1.0,
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

    /// The costs under these gains, with vectors of this kind, which makes no difference to them.
    fn evaluate_with(
        &self,
        gains: &GainTable,
        level: Level,
        scene: &Scene,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
    ) -> Costs {
        let turn = self.field.map_from_grid();
        let sigma = turn.transpose() * scene.belief.covariance * turn;
        let drive =
            Drive { field: &self.field, gains, model: self.step_model(candidates.dt()), sigma, candidates };
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

    /// The costs with vectors of this kind.
    pub(super) fn evaluate_at(
        &self,
        level: Level,
        scene: &Scene,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
    ) -> Costs {
        self.evaluate_with(&GainTable::new(candidates.dt()), level, scene, candidates, should_stop)
    }

    fn step_model(&self, dt: f64) -> StepModel {
        // A threshold of zero asks for an update every step.
        let rate = |threshold: f64| 1.0 / threshold.max(1e-6);
        let CpcParams { update_min_d, update_min_a, update_max_interval } = self.params;
        let updates = (rate(update_min_d), rate(update_min_a), dt * rate(update_max_interval));
        StepModel { noise: self.noise, dt, updates }
    }
}

/// What all candidates of a batch have in common.
struct Drive<'a> {
    field: &'a InformationField,
    gains: &'a GainTable,
    model: StepModel,
    /// The belief's covariance in the grid's axes.
    sigma: Matrix3<f64>,
    candidates: &'a CandidateSet,
}

impl Drive<'_> {
    /// Zeta of the candidates from `first` on, side by side. The last group is filled up with copies of the last
    /// candidate.
    #[inline(always)]
    fn zeta<S: Simd>(&self, simd: S, first: usize) -> [f64; LANES] {
        let (set, states) = (self.candidates, self.candidates.all_states());
        let rows: [_; LANES] = std::array::from_fn(|lane| set.range((first + lane).min(set.len() - 1)));
        let [x, y, heading, v, omega] = [&states.x, &states.y, &states.heading, &states.v, &states.omega]
            .map(|of| rows.each_ref().map(|row| &of[row.clone()]));
        let mut covariances = Covariances::new(simd, &self.sigma);
        for k in 0..set.steps() {
            let lanes = |of: &[&[f64]; LANES]| f64x8::from_fn(simd, |lane| of[lane][k]);
            let (heading, v) = (lanes(&heading), lanes(&v));
            let (travel, turn) = (v * set.dt(), lanes(&omega) * set.dt());
            // Linearised half way through the step, where the chord of the arc points: better than Euler's at its
            // start, and no other state is needed.
            let chord = heading - self.field.grid_heading() - 0.5 * turn;
            let step = Step {
                sin_cos: sin_cos(chord),
                travel,
                turn,
                gains: self.gains.at(v),
                information: self.field.factors_at(lanes(&x), lanes(&y), heading),
            };
            covariances.step(&self.model, &step);
        }
        covariances.zeta.into()
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
mod tests;
