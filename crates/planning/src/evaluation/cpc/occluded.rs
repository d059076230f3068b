//! CPC where people hide landmarks: what the paper leaves for later (A32).
//!
//! The information of a scan is a sum over rays, of which each counts as far as no one stands in it:
//! ```text
//! J = sum_b w_b s_b h_b h_b^T        s_b = prod_i (1 - q_ib)
//! q_ib = Phi((r - delta) / sigma) + Phi((r + delta) / sigma) - 1    if 0 < rho cos(beta_b - phi) < r_b, else 0
//! ```
//! with delta = rho sin(beta_b - phi): person i, a disc of radius r, is predicted at distance rho and bearing phi from
//! the laser, with the standard deviation sigma on each axis; ray b goes r_b metres in direction beta_b until it meets
//! a wall. So q is the chance that the person is in the ray. The Gaussian is cut at four sigma, so that people who are
//! far from every ray change no bit.

use std::sync::{Arc, LazyLock};

use nalgebra::Matrix3;

use super::beam_fan::{Information, factorise};
use super::information_field::InformationField;
use super::lqr::GainTable;
use super::ray_field::{BlockRays, GROUPS, OfRays, RayField, View};
use super::{CpcEvaluator, Observation};
use crate::candidates::CandidateSet;
use crate::evaluation::{Costs, Evaluator};
use crate::forecast::ForecastParams;
use crate::lanes::*;
use crate::numerics::erf;
use crate::scene::{People, Scene};

/// Term `cpc-occluded`: zeta of eq. 15 as `cpc` has it, with the information that people leave of each scan.
///
/// Where no one stands in a ray that is in view, a state's information is that of `cpc`, bit for bit; so is the whole
/// cost of a candidate along which this holds for all states, and of every candidate when no people are present.
#[derive(Debug, Clone)]
pub struct CpcOccludedEvaluator {
    cpc: CpcEvaluator,
    rays: Arc<RayField>,
    forecast: ForecastParams,
}

impl CpcOccludedEvaluator {
    /// Evaluates as `cpc` does, on the map and laser that `rays` has been made for as well.
    pub fn new(cpc: CpcEvaluator, rays: Arc<RayField>, forecast: ForecastParams) -> Self {
        Self { cpc, rays, forecast }
    }

    /// What the localiser is predicted to know along candidate `index`: `Sigma` of eq. 11 after each state, map frame.
    pub fn predicted(&self, scene: &Scene, candidates: &CandidateSet, index: usize) -> Vec<Matrix3<f64>> {
        let mut predicted = Vec::new();
        let alone = candidates.pick([index]);
        let hidden = self.hidden(&scene.people, &alone);
        let sigma = &scene.belief.covariance;
        let found =
            self.cpc.along_with(&hidden, sigma, &alone, &|| false, |_, sigmas| predicted = sigmas.to_vec());
        debug_assert_eq!(found, Ok(()));
        predicted
    }

    /// The costs with vectors of this kind, which makes no difference to them.
    pub(in crate::evaluation) fn evaluate_at(
        &self,
        level: Level,
        scene: &Scene,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
    ) -> Costs {
        let hidden = self.hidden(&scene.people, candidates);
        let gains = GainTable::new(candidates.dt());
        self.cpc.evaluate_with(&hidden, &gains, level, scene, candidates, should_stop)
    }

    /// Where people will be at each state of the candidates.
    fn hidden(&self, people: &People, candidates: &CandidateSet) -> Hidden<'_> {
        let field = &*self.cpc.field;
        let at = |step: usize, i: usize| {
            let t = (step + 1) as f64 * candidates.dt();
            let forecast = self.forecast.variance_at(people.speed(i), t);
            let sigma = (forecast + people.variance_after(i, t)).sqrt().max(LEAST_SIGMA);
            let p = field.grid_from_map(people.position_after(i, t));
            let across = people.radius + CUT * sigma;
            let reach = self.rays.reach;
            Hiding {
                x: p.x,
                y: p.y,
                across,
                reach_squared: reach * reach + across * across,
                per_sigma: 1.0 / sigma,
            }
        };
        let places = (0..candidates.steps()).flat_map(|step| (0..people.len()).map(move |i| at(step, i)));
        let places = places.collect();
        let rays = &*self.rays;
        let normal = &*NORMAL;
        Hidden { field, rays, people: people.len(), radius: people.radius, places, normal }
    }
}

impl Evaluator for CpcOccludedEvaluator {
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        self.evaluate_at(Level::new(), scene, candidates, should_stop)
    }
}

/// Least standard deviation of a person's position, metres: much below a ray's width it changes nothing.
const LEAST_SIGMA: f64 = 1e-3;

/// One person at one moment.
struct Hiding {
    /// In the grid's axes, metres.
    x: f64,
    y: f64,
    /// Metres between a ray and the person's middle from which on the person is not in it.
    across: f64,
    /// Square of the distance from the laser from which on the person is in no ray, m2.
    reach_squared: f64,
    /// One through the standard deviation of each coordinate, 1/m.
    per_sigma: f64,
}

/// What a scan tells after each step, with people in the way.
struct Hidden<'a> {
    field: &'a InformationField,
    rays: &'a RayField,
    people: usize,
    /// Of each person, metres.
    radius: f64,
    /// `[step][person]`.
    places: Vec<Hiding>,
    normal: &'static Normal,
}

impl Observation for Hidden<'_> {
    #[inline(always)]
    fn factors_at<S: Simd>(&self, step: usize, x: f64x8<S>, y: f64x8<S>, heading: f64x8<S>) -> [f64x8<S>; 6] {
        let laser = self.field.laser_at(x, y, heading);
        let places = self.field.places(&laser);
        let mut factors = self.field.stored(x.simd, &places);
        let people = &self.places[step * self.people..(step + 1) * self.people];
        if !people.is_empty() {
            for (lane, place) in places.into_iter().enumerate() {
                if let Some(left) = self.left(x.simd, people, place, laser.x[lane], laser.y[lane]) {
                    factors.iter_mut().zip(left).for_each(|(factor, left)| factor[lane] = f64::from(left));
                }
            }
        }
        self.field.of_robot(&laser, factors)
    }
}

impl Hidden<'_> {
    /// What `people` leave of the scan at `place` for a laser at (x, y), as a factor; none if they hide nothing.
    #[inline(always)]
    fn left<S: Simd>(&self, simd: S, people: &[Hiding], place: usize, x: f64, y: f64) -> Option<[f32; 6]> {
        let is_near = |person: &&Hiding| {
            let dx = person.x - x;
            let dy = person.y - y;
            dx * dx + dy * dy < person.reach_squared
        };
        let (block, heading) = self.field.seeing_at(place)?;
        let block = &self.rays.blocks[block];
        let view = &self.rays.views[heading];
        let one = f64x8::splat(simd, 1.0);
        let mut survival = [one; GROUPS];
        let mut is_hidden = false;
        for person in people.iter().filter(is_near) {
            let px = person.x - x;
            let py = person.y - y;
            for &group in &view.groups {
                let [dx, dy] =
                    self.rays.directions.each_ref().map(|of| f64x8::load_array_ref(simd, &of[group]));
                let along = dx * px + dy * py;
                let off = (dy * px - dx * py).abs();
                let is_in = along.simd_gt(0.0)
                    & along.simd_lt(wide(simd, &block.range[group]))
                    & off.simd_lt(person.across)
                    & f64x8::load_array_ref(simd, &view.weights[group]).simd_gt(0.0);
                if is_in.any_true() {
                    is_hidden = true;
                    let free = one - chance(self.normal, self.radius, off, person.per_sigma);
                    survival[group] *= is_in.select(free, one);
                }
            }
        }
        is_hidden.then(|| factorise(&sum(simd, &self.rays.directions, view, block, &survival)))
    }
}

/// The information of the rays in view, each times its survival: lane by lane over the groups, then over the lanes.
#[inline(always)]
fn sum<S: Simd>(
    simd: S,
    directions: &[OfRays<f64>; 2],
    view: &View,
    block: &BlockRays,
    survival: &[f64x8<S>; GROUPS],
) -> Information {
    let mut sums = [f64x8::splat(simd, 0.0); 6];
    for &group in &view.groups {
        let [dx, dy] = directions.each_ref().map(|of| f64x8::load_array_ref(simd, &of[group]));
        let [x, y] = block.row.each_ref().map(|of| wide(simd, &of[group]));
        let t = wide(simd, &block.range[group]) * (y * dx - x * dy);
        let weight = f64x8::load_array_ref(simd, &view.weights[group]) * survival[group];
        let wx = weight * x;
        let wy = weight * y;
        let wt = weight * t;
        sums[0] += wx * x;
        sums[1] += wx * y;
        sums[2] += wx * t;
        sums[3] += wy * y;
        sums[4] += wy * t;
        sums[5] += wt * t;
    }
    sums.map(|lanes| <[f64; LANES]>::from(lanes).iter().sum())
}

#[inline(always)]
fn wide<S: Simd>(simd: S, numbers: &[f32; LANES]) -> f64x8<S> {
    f64x8::from_fn(simd, |lane| f64::from(numbers[lane]))
}

/// q: the chance that a person is in rays that go past its predicted middle at `off` metres.
#[inline(always)]
fn chance<S: Simd>(normal: &Normal, radius: f64, off: f64x8<S>, per_sigma: f64) -> f64x8<S> {
    let below = at(normal, (radius - off) * per_sigma);
    greater(below + at(normal, (radius + off) * per_sigma) - 1.0, f64x8::splat(off.simd, 0.0))
}

/// Standard deviations at which the Gaussian is cut.
const CUT: f64 = 4.0;
/// Entries of [`NORMAL`] per standard deviation: in between, a straight line is off by less than 3e-5.
const PER_SIGMA: usize = 32;
const ENTRIES: usize = 2 * CUT as usize * PER_SIGMA;

/// The distribution function at the lower end of each interval, and what it grows by to the upper end.
type Normal = [[f64; 2]; ENTRIES];

/// Of the standard normal distribution that is cut at [`CUT`]. It grows ever more slowly above 0, as does a chain of
/// straight lines through it: so a person nearer to a ray never hides less of it.
static NORMAL: LazyLock<Normal> = LazyLock::new(|| {
    let unit = |x: f64| erf(x * std::f64::consts::FRAC_1_SQRT_2);
    let value = |i: usize| 0.5 + 0.5 * unit(i as f64 / PER_SIGMA as f64 - CUT) / unit(CUT);
    std::array::from_fn(|i| [value(i), value(i + 1) - value(i)])
});

#[inline(always)]
fn at<S: Simd>(normal: &Normal, x: f64x8<S>) -> f64x8<S> {
    let zero = f64x8::splat(x.simd, 0.0);
    let most = f64x8::splat(x.simd, ENTRIES as f64);
    let u = lesser(greater((x + CUT) * PER_SIGMA as f64, zero), most);
    let interval = lesser(floor(u), most - 1.0);
    let at = indices(interval);
    let [low, more] = [0, 1].map(|k| f64x8::from_fn(x.simd, |lane| normal[at[lane]][k]));
    low + (u - interval) * more
}

#[cfg(test)]
#[path = "occluded_tests.rs"]
mod tests;
