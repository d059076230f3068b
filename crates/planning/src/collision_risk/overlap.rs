//! How likely contact with one person is, by distance.

use std::collections::BTreeMap;
use std::sync::{Arc, Mutex, PoisonError};

use crate::lanes::*;
use crate::numerics::asin;

/// Entries of a table over distance.
const ENTRIES: usize = 32;
/// Standard deviations beyond contact at which a person no longer counts.
pub(super) const CUT: f64 = 4.0;

/// Tables of a process that have been made, by contact and sigma: forecasts spread alike in every cycle. At most so
/// many, a few megabytes; then all are forgotten.
static MADE: Mutex<BTreeMap<[u64; 2], Arc<OverlapTable>>> = Mutex::new(BTreeMap::new());
const MADE_MAX: usize = 4096;

/// Probability of contact by distance between the robot and the mean of a person's forecast.
#[derive(Debug, Clone)]
pub(super) struct OverlapTable {
    reach_squared: f64,
    per_metre: f64,
    /// More than are looked up, so that interpolation has a right neighbour, and in whole groups of lanes.
    probability: [f64; ENTRIES + LANES],
}

impl Default for OverlapTable {
    fn default() -> Self {
        Self { reach_squared: 0.0, per_metre: 0.0, probability: [0.0; ENTRIES + LANES] }
    }
}

impl OverlapTable {
    /// The table for these lengths, metres. It is a function of them alone, made once.
    pub(super) fn of(level: Level, contact: f64, sigma: f64) -> Arc<Self> {
        let mut made = MADE.lock().unwrap_or_else(PoisonError::into_inner);
        if made.len() >= MADE_MAX {
            made.clear();
        }
        let table = made.entry([contact.to_bits(), sigma.to_bits()]);
        Arc::clone(table.or_insert_with(|| Arc::new(Self::new(level, contact, sigma))))
    }

    fn new(level: Level, contact: f64, sigma: f64) -> Self {
        let reach = contact + CUT * sigma;
        let step = reach / ENTRIES as f64;
        let mut table = Self { reach_squared: reach * reach, per_metre: 1.0 / step, ..Self::default() };
        if sigma > 0.0 {
            dispatch!(level, simd => table.fill(simd, contact, sigma, step));
        } else {
            for (k, probability) in table.probability.iter_mut().enumerate() {
                *probability = f64::from(u8::from(k as f64 * step < contact));
            }
        }
        table
    }

    #[inline(always)]
    fn fill<S: Simd>(&mut self, simd: S, contact: f64, sigma: f64, step: f64) {
        let whole = WholeDisc::new(simd, contact, sigma);
        for (group, probability) in self.probability.chunks_exact_mut(LANES).enumerate() {
            let distances: [f64; LANES] = std::array::from_fn(|lane| (group * LANES + lane) as f64 * step);
            let found = if distances.iter().all(|distance| whole.is_near(*distance)) {
                whole.probability(simd, distances)
            } else {
                disc_probability(simd, contact, distances, [sigma; LANES])
            };
            probability.copy_from_slice(&found);
        }
    }

    /// `free` times the probability of touching none of eight people at these squared distances, linear between
    /// entries.
    #[inline(always)]
    pub(super) fn times_free<S: Simd>(&self, mut free: f64, squared: f64x8<S>) -> f64 {
        let mut near = squared.simd_lt(self.reach_squared).to_bitmask();
        if near == 0 {
            return free;
        }
        let place = squared.sqrt() * self.per_metre;
        let whole = floor(place);
        let entry = indices(whole);
        let part = place - whole;
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            let k = entry[lane].min(ENTRIES);
            let a = self.probability[k];
            let b = self.probability[k + 1];
            free *= 1.0 - (a + part[lane] * (b - a));
            near &= near - 1;
        }
        free
    }
}

/// Intervals of Simpson's rule.
const INTERVALS: u32 = 24;
/// Standard deviations from the mean of a Gaussian at which nothing is left of it.
const WIDEST: f64 = 6.0;

/// Shares of isotropic Gaussians inside a disc of `radius` whose centre is at each of `distances` from the mean of the
/// one with the standard deviation in `sigmas`, which is positive; all in metres.
///
/// Strips across the line of centres: the one at `x = radius sin u` has the closed form
/// `density(x) erf(radius cos u / (sigma sqrt 2))`; Simpson's rule in `u`, in which it is smooth.
#[inline(always)]
pub(super) fn disc_probability<S: Simd>(
    simd: S,
    radius: f64,
    distances: [f64; LANES],
    sigmas: [f64; LANES],
) -> [f64; LANES] {
    let limit = |by: f64| {
        let bound = |lane: usize| ((distances[lane] + by * sigmas[lane]) / radius).clamp(-1.0, 1.0);
        f64x8::load_array(simd, std::array::from_fn(|lane| asin(bound(lane))))
    };
    let low = limit(-WIDEST);
    let high = limit(WIDEST);
    let h = (high - low) / f64::from(INTERVALS);
    let distance = f64x8::load_array(simd, distances);
    let sigma = f64x8::load_array(simd, sigmas);
    let mut sum = f64x8::splat(simd, 0.0);
    for k in 0..=INTERVALS {
        let (s, c) = library::sin_cos(low + f64::from(k) * h);
        let erf = library::erf(radius * c / (sigma * std::f64::consts::SQRT_2));
        sum += strip(k, (radius * s - distance) / sigma, erf, radius, c);
    }
    share(sum, h, sigma)
}

/// What strip `k` adds to the sum: `z` is where it is, in standard deviations, and `radius * c` half its length.
#[inline(always)]
fn strip<S: Simd>(k: u32, z: f64x8<S>, erf: f64x8<S>, radius: f64, c: f64x8<S>) -> f64x8<S> {
    let weight = if k == 0 || k == INTERVALS { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
    weight * (library::exp(-0.5 * z * z) * erf * radius * c)
}

/// The share inside the disc, from the sum over strips that are `h` radians apart.
#[inline(always)]
fn share<S: Simd>(sum: f64x8<S>, h: f64x8<S>, sigma: f64x8<S>) -> [f64; LANES] {
    let share: [f64; LANES] = (sum * h / 3.0 / (sigma * std::f64::consts::TAU.sqrt())).into();
    share.map(|share| share.clamp(0.0, 1.0))
}

/// The strips of a disc of which no part is too far away to matter: the same for all distances.
struct WholeDisc {
    radius: f64,
    sigma: f64,
    /// Between two strips, radians.
    h: f64,
    x: [f64; STRIPS],
    erf: [f64; STRIPS],
    cos: [f64; STRIPS],
}

/// Strips, in whole groups of lanes.
const STRIPS: usize = (INTERVALS as usize + 1).next_multiple_of(LANES);

impl WholeDisc {
    #[inline(always)]
    fn new<S: Simd>(simd: S, radius: f64, sigma: f64) -> Self {
        let low = asin(-1.0);
        let high = asin(1.0);
        let h = (high - low) / f64::from(INTERVALS);
        let [mut x, mut erf, mut cos] = [[0.0; STRIPS]; 3];
        for first in (0..STRIPS).step_by(LANES) {
            let group = first..first + LANES;
            let (s, c) = library::sin_cos(low + f64x8::from_fn(simd, |lane| (first + lane) as f64) * h);
            (radius * s).store_slice(&mut x[group.clone()]);
            c.store_slice(&mut cos[group.clone()]);
            let sigma = f64x8::splat(simd, sigma);
            library::erf(radius * c / (sigma * std::f64::consts::SQRT_2)).store_slice(&mut erf[group]);
        }
        Self { radius, sigma, h, x, erf, cos }
    }

    fn is_near(&self, distance: f64) -> bool {
        let bound = |by: f64| (distance + by * self.sigma) / self.radius;
        bound(-WIDEST) <= -1.0 && bound(WIDEST) >= 1.0
    }

    /// [`disc_probability`] at distances that are near.
    #[inline(always)]
    fn probability<S: Simd>(&self, simd: S, distances: [f64; LANES]) -> [f64; LANES] {
        let distance = f64x8::load_array(simd, distances);
        let sigma = f64x8::splat(simd, self.sigma);
        let mut sum = f64x8::splat(simd, 0.0);
        for k in 0..=INTERVALS {
            let [x, erf, c] = [&self.x, &self.erf, &self.cos].map(|of| f64x8::splat(simd, of[k as usize]));
            sum += strip(k, (x - distance) / sigma, erf, self.radius, c);
        }
        share(sum, f64x8::splat(simd, self.h), sigma)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::tests::levels;
    use crate::numerics;
    use crate::random::{rng, standard_normal, uniform};

    /// [`disc_probability`] for one distance, by the library's functions.
    fn exact(radius: f64, distance: f64, sigma: f64) -> f64 {
        let bound = |x: f64| (x / radius).clamp(-1.0, 1.0);
        let low = asin(bound(distance - 6.0 * sigma));
        let high = asin(bound(distance + 6.0 * sigma));
        let h = (high - low) / 24.0;
        let sum = (0..=24).fold(0.0, |sum, k| {
            let (s, c) = numerics::sin_cos(low + f64::from(k) * h);
            let z = (radius * s - distance) / sigma;
            let erf = numerics::erf(radius * c / (sigma * std::f64::consts::SQRT_2));
            let strip = numerics::exp(-0.5 * z * z) * erf * radius * c;
            sum + if k == 0 || k == 24 { 1.0 } else { f64::from(2 + 2 * (k % 2)) } * strip
        });
        (sum * h / 3.0 / (sigma * std::f64::consts::TAU.sqrt())).clamp(0.0, 1.0)
    }

    /// The probability of touching one person at `distance` by a table.
    fn by_table(level: Level, table: &OverlapTable, distance: f64) -> f64 {
        let squared = std::array::from_fn(|lane| if lane == 3 { distance * distance } else { f64::INFINITY });
        1.0 - dispatch!(level, simd => table.times_free(1.0, f64x8::load_array(simd, squared)))
    }

    #[test]
    fn tables_have_the_bits_of_the_formula_with_every_kind_of_vectors() {
        let mut r = rng(4, 0);
        for _ in 0..200 {
            let contact = 0.2 + uniform(&mut r);
            let sigma = 3.0 * uniform(&mut r);
            let step = (contact + CUT * sigma) / ENTRIES as f64;
            for level in levels() {
                let table = OverlapTable::new(level, contact, sigma);
                for (k, probability) in table.probability.iter().enumerate() {
                    assert_eq!(probability.to_bits(), exact(contact, k as f64 * step, sigma).to_bits());
                }
            }
        }
    }

    #[test]
    fn the_probability_is_the_share_of_samples_inside() {
        let mut r = rng(3, 0);
        for (distance, sigma) in [(0.0, 0.1), (0.5, 0.1), (0.55, 0.3), (1.0, 0.6), (2.0, 1.0)] {
            let n = 200_000;
            let inside = (0..n)
                .filter(|_| {
                    let x = distance + sigma * standard_normal(&mut r);
                    let y = sigma * standard_normal(&mut r);
                    x * x + y * y < 0.55 * 0.55
                })
                .count();
            let exact = exact(0.55, distance, sigma);
            let table = by_table(Level::new(), &OverlapTable::new(Level::new(), 0.55, sigma), distance);
            let sampled = inside as f64 / f64::from(n);
            assert!((exact - sampled).abs() < 0.004, "{distance} {sigma}: {exact} {sampled}");
            assert!((exact - table).abs() < 0.003, "{distance} {sigma}: {exact} {table}");
        }
    }
}
