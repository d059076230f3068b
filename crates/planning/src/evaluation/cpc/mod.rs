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

use crate::candidates::CandidateSet;
use crate::evaluation::{Costs, Evaluator, Stopped};
use crate::motion::OdometryNoise;
use crate::numerics::sin_cos;
use crate::scene::Scene;

pub use beam_fan::MeasurementModel;
use covariance::{Covariances, LANES, Step, StepModel, Steps};
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

    fn evaluate_with(
        &self,
        gains: &GainTable,
        scene: &Scene,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
    ) -> Costs {
        let model = self.step_model(candidates.dt());
        let turn = self.field.map_from_grid();
        let start = Covariances::new(&(turn.transpose() * scene.belief.covariance * turn));
        let mut costs = Vec::with_capacity(candidates.len());
        let mut steps = Steps::new();
        for first in (0..candidates.len()).step_by(LANES) {
            if should_stop() {
                return Err(Stopped);
            }
            // The last group is filled up with copies of the last candidate.
            let rows: [usize; LANES] =
                std::array::from_fn(|lane| (first + lane).min(candidates.len() - 1) * candidates.steps());
            let mut covariances = start.clone();
            for k in 0..candidates.steps() {
                for (lane, row) in rows.iter().enumerate() {
                    steps.set(lane, &self.step(gains, candidates, row + k));
                }
                covariances.step(&model, &steps);
            }
            costs.extend(covariances.zeta().iter().take(candidates.len() - first));
        }
        Ok(costs)
    }

    fn step_model(&self, dt: f64) -> StepModel {
        // A threshold of zero asks for an update every step.
        let rate = |threshold: f64| 1.0 / threshold.max(1e-6);
        let CpcParams { update_min_d, update_min_a, update_max_interval } = self.params;
        let updates = (rate(update_min_d), rate(update_min_a), dt * rate(update_max_interval));
        StepModel { noise: self.noise, dt, updates }
    }

    /// What the step that leads to state `i` does. Linearised half way through the step, where the
    /// chord of the arc points: better than Euler's at its start, and no other state is needed.
    #[inline]
    fn step(&self, gains: &GainTable, candidates: &CandidateSet, i: usize) -> Step {
        let (heading, v) = (candidates.all_states().heading[i], candidates.all_states().v[i]);
        let (travel, turn) = (v * candidates.dt(), candidates.all_states().omega[i] * candidates.dt());
        Step {
            sin_cos: sin_cos(heading - self.field.grid_heading() - 0.5 * turn),
            travel,
            turn,
            gains: gains.at(v),
            information: self.field.factor(
                candidates.all_states().x[i],
                candidates.all_states().y[i],
                heading,
            ),
        }
    }
}

impl Evaluator for CpcEvaluator {
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        self.evaluate_with(&GainTable::new(candidates.dt()), scene, candidates, should_stop)
    }
}

#[cfg(test)]
mod reference_tests;
#[cfg(test)]
mod tests;
