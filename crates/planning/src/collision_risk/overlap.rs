//! How likely contact with one person is, by distance.

use crate::lanes::*;
use crate::numerics::asin;

/// Entries of a table over distance.
const ENTRIES: usize = 32;
/// Standard deviations beyond contact at which a person no longer counts.
pub(super) const CUT: f64 = 4.0;

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
    pub(super) fn new(level: Level, contact: f64, sigma: f64) -> Self {
        let reach = contact + CUT * sigma;
        let step = reach / ENTRIES as f64;
        let mut table = Self { reach_squared: reach * reach, per_metre: 1.0 / step, ..Self::default() };
        for (group, probability) in table.probability.chunks_exact_mut(LANES).enumerate() {
            let distances = std::array::from_fn(|lane| (group * LANES + lane) as f64 * step);
            let found = if sigma > 0.0 {
                dispatch!(level, simd => disc_probability(simd, contact, distances, [sigma; LANES]))
            } else {
                distances.map(|distance| if distance < contact { 1.0 } else { 0.0 })
            };
            probability.copy_from_slice(&found);
        }
        table
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
        while near != 0 {
            let s = place[near.trailing_zeros() as usize];
            let k = (s as usize).min(ENTRIES);
            let (a, b) = (self.probability[k], self.probability[k + 1]);
            free *= 1.0 - (a + (s - k as f64) * (b - a));
            near &= near - 1;
        }
        free
    }
}

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
    const INTERVALS: u32 = 24;
    let limit = |by: f64| {
        let bound = |lane: usize| ((distances[lane] + by * sigmas[lane]) / radius).clamp(-1.0, 1.0);
        f64x8::load_array(simd, std::array::from_fn(|lane| asin(bound(lane))))
    };
    let (low, high) = (limit(-6.0), limit(6.0));
    let h = (high - low) / f64::from(INTERVALS);
    let (distance, sigma) = (f64x8::load_array(simd, distances), f64x8::load_array(simd, sigmas));
    let mut sum = f64x8::splat(simd, 0.0);
    for k in 0..=INTERVALS {
        let (s, c) = library::sin_cos(low + f64::from(k) * h);
        let z = (radius * s - distance) / sigma;
        let density = library::exp(-0.5 * z * z);
        let strip = density * library::erf(radius * c / (sigma * std::f64::consts::SQRT_2)) * radius * c;
        let weight = if k == 0 || k == INTERVALS { 1.0 } else { f64::from(2 + 2 * (k % 2)) };
        sum += weight * strip;
    }
    let share: [f64; LANES] = (sum * h / 3.0 / (sigma * std::f64::consts::TAU.sqrt())).into();
    share.map(|share| share.clamp(0.0, 1.0))
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
        let (low, high) = (asin(bound(distance - 6.0 * sigma)), asin(bound(distance + 6.0 * sigma)));
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
            let (contact, sigma) = (0.2 + uniform(&mut r), 3.0 * uniform(&mut r));
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
                    let (x, y) =
                        (distance + sigma * standard_normal(&mut r), sigma * standard_normal(&mut r));
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
