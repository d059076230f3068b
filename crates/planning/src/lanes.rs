//! Eight numbers side by side: what the cost terms compute with.
//!
//! There are eight lanes on every machine. A machine with wide vectors computes them in one instruction, another in
//! several, with the same operations in the same order; multiplications and additions are never fused. So the bits do
//! not depend on the machine, and no lane on another.
//!
//! A function here must be inlined into the one that [`dispatch`] calls: only there are wide vectors allowed. A closure
//! cannot be told to, so what computes with lanes is no closure, and is not passed to the library's iterators.

pub(crate) use fearless_simd::prelude::*;
pub(crate) use fearless_simd::{Level, Simd, dispatch, f64x8};

pub(crate) mod library;

use fearless_simd::u64x8;

use crate::numerics;

/// Numbers side by side.
pub(crate) const LANES: usize = 8;

/// `if is_less { a } else { b }` with `is_less` = a < b: unlike `min`, the same for zeros of both signs everywhere.
#[inline(always)]
pub(crate) fn lesser<S: Simd>(a: f64x8<S>, b: f64x8<S>) -> f64x8<S> {
    a.simd_lt(b).select(a, b)
}

/// The same with a > b.
#[inline(always)]
pub(crate) fn greater<S: Simd>(a: f64x8<S>, b: f64x8<S>) -> f64x8<S> {
    a.simd_gt(b).select(a, b)
}

/// The numbers rounded down, for 0 <= x < 2^32. Below and above, it is a whole number or none at all.
#[inline(always)]
pub(crate) fn floor<S: Simd>(x: f64x8<S>) -> f64x8<S> {
    let nearest = (x + WHOLE) - WHOLE;
    nearest - nearest.simd_gt(x).select(f64x8::splat(x.simd, 1.0), f64x8::splat(x.simd, 0.0))
}

/// Whole numbers from 0 below 2^32 as indices; some index for anything else.
#[inline(always)]
pub(crate) fn indices<S: Simd>(whole: f64x8<S>) -> [usize; LANES] {
    let bits: u64x8<S> = (whole + WHOLE).bitcast();
    let bits: [u64; LANES] = bits.into();
    bits.map(|b| b as u32 as usize)
}

/// 1.5 * 2^52: adding it rounds to a whole number, whose bits are then the lowest of the sum.
const WHOLE: f64 = 6_755_399_441_055_744.0;

/// Sine and cosine, each within 2^-52 of the exact value.
///
/// The quarter turn is taken off in three parts (Cody and Waite), and the rest is put into the polynomials of fdlibm's
/// kernels. Beyond [`FAR`] radians the parts are too few; such lanes take [`numerics::sin_cos`].
#[inline(always)]
pub(crate) fn sin_cos<S: Simd>(x: f64x8<S>) -> (f64x8<S>, f64x8<S>) {
    let shifted = x * std::f64::consts::FRAC_2_PI + WHOLE;
    let quarters = shifted - WHOLE;
    let r = x - quarters * QUARTER[0] - quarters * QUARTER[1] - quarters * QUARTER[2];
    let z = r * r;
    let sine = r + r * z * polynomial(z, SINE);
    let half = z * 0.5;
    let most = 1.0 - half;
    let cosine = most + ((1.0 - most - half) + z * polynomial(z, COSINE) * z);

    // An odd number of quarters exchanges the two, and half a turn changes a sign.
    let bits: u64x8<S> = shifted.bitcast();
    let odd = (bits & 1).simd_eq(1);
    let mut sin = negated_if(odd.select(cosine, sine), bits);
    let mut cos = negated_if(odd.select(sine, cosine), bits + 1);
    if x.abs().simd_gt(FAR).any_true() {
        for lane in (0..LANES).filter(|&lane| x[lane].abs() > FAR) {
            (sin[lane], cos[lane]) = numerics::sin_cos(x[lane]);
        }
    }
    (sin, cos)
}

/// The sum of the coefficients times powers of `z`, the highest first.
#[inline(always)]
fn polynomial<S: Simd>(z: f64x8<S>, [a, b, c, d, e, f]: [f64; 6]) -> f64x8<S> {
    ((((z * a + b) * z + c) * z + d) * z + e) * z + f
}

/// The number with its sign changed where the second bit of `quarters` is set.
#[inline(always)]
fn negated_if<S: Simd>(number: f64x8<S>, quarters: u64x8<S>) -> f64x8<S> {
    let bits: u64x8<S> = number.bitcast();
    (bits ^ ((quarters & 2) << 62)).bitcast()
}

/// Radians up to which the multiples of [`QUARTER`]'s first two parts are exact.
const FAR: f64 = 100_000.0;
/// Half of pi in three parts, of which the first two have 33 bits each.
const QUARTER: [f64; 3] = [1.570_796_326_734_125_6, 6.077_100_506_303_966e-11, 2.022_266_248_795_950_6e-21];
/// (sin r / r - 1) / r^2 in powers of r^2, the highest first.
const SINE: [f64; 6] = [
    1.589_690_995_211_55e-10,
    -2.505_076_025_340_686_3e-8,
    2.755_731_370_707_006_8e-6,
    -1.984_126_982_985_795e-4,
    8.333_333_333_322_49e-3,
    -0.166_666_666_666_666_32,
];
/// (cos r - 1 + r^2 / 2) / r^4 in powers of r^2, the highest first.
const COSINE: [f64; 6] = [
    -1.135_964_755_778_819_5e-11,
    2.087_572_321_298_175e-9,
    -2.755_731_435_139_066_3e-7,
    2.480_158_728_947_673e-5,
    -1.388_888_888_887_411e-3,
    0.041_666_666_666_666_6,
];

/// Natural exponential for -8.1 <= x <= 0 only, relative error below 1e-12 and exactly 1 at 0.
///
/// A Gaussian cut at four sigma needs no more (its argument is at least -4^2/2 = -8). There are no branches, tables or
/// range reduction: e^x = p(x)^128, with p the degree-6 polynomial that equals e^(x/128) at 0 and at six Chebyshev
/// nodes of the interval.
#[inline(always)]
pub(crate) fn exp_minus_8_to_0<S: Simd>(x: f64x8<S>) -> f64x8<S> {
    const C: [f64; 6] = [
        0.007812499999999952,
        3.051757812457803e-5,
        7.94728590923973e-8,
        1.5522010839637334e-10,
        2.424553896616902e-13,
        3.073578814104865e-16,
    ];
    let x2 = x * x;
    let low = 1.0 + C[0] * x;
    let middle = C[1] + C[2] * x;
    let high = C[3] + C[4] * x + C[5] * x2;
    let mut p = low + x2 * middle + (x2 * x2) * high;
    for _ in 0..7 {
        p *= p;
    }
    p
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use crate::random::{Rng, rng, uniform};

    /// Every kind of vectors that this machine has, the narrowest first.
    pub(crate) fn levels() -> Vec<Level> {
        let best = Level::new();
        let mut levels = vec![Level::baseline()];
        #[cfg(target_arch = "x86_64")]
        {
            levels.extend(best.as_sse4_2().map(Level::Sse4_2));
            levels.extend(best.as_avx2().map(Level::Avx2));
            levels.extend(best.as_avx512().map(Level::Avx512));
        }
        levels.push(best);
        levels
    }

    #[inline(always)]
    fn all<S: Simd>(simd: S, x: [f64; LANES]) -> [[f64; LANES]; 4] {
        let lanes = f64x8::load_array(simd, x);
        let (sin, cos) = sin_cos(lanes);
        [sin, cos, floor(lanes), exp_minus_8_to_0(lanes)].map(Into::into)
    }

    /// Numbers of every size at which something changes, with zeros of both signs.
    fn numbers(r: &mut Rng, k: usize) -> [f64; LANES] {
        let size = [1e-9, 0.1, 1.0, 4.0, 10.0, 1e3, 1e5, 1e9, 1e300][k % 9];
        std::array::from_fn(|lane| match lane {
            0 => 0.0,
            1 => -0.0,
            // As near to a multiple of a quarter turn as a number can be.
            2 => (k as f64 * uniform(r)).round() * std::f64::consts::FRAC_PI_2,
            _ => size * (2.0 * uniform(r) - 1.0),
        })
    }

    #[test]
    fn every_kind_of_vectors_gives_the_same_bits() {
        let seed = 1;
        let levels = levels();
        let mut r = rng(seed, 0);
        for k in 0..20_000 {
            let x = numbers(&mut r, k);
            let bits = |level| {
                let results: [[f64; LANES]; 4] = dispatch!(level, simd => all(simd, x));
                results.map(|lanes| lanes.map(f64::to_bits))
            };
            let first = bits(levels[0]);
            for &level in &levels[1..] {
                assert_eq!(bits(level), first, "seed {seed}, {level:?} at {x:?}");
            }
        }
    }

    #[test]
    fn sine_and_cosine_are_those_of_the_library_but_for_the_last_bit() {
        let seed = 2;
        let mut r = rng(seed, 0);
        for k in 0..200_000 {
            let x = numbers(&mut r, k);
            let [sin, cos, ..] = dispatch!(Level::new(), simd => all(simd, x));
            for lane in 0..LANES {
                let (s, c) = numerics::sin_cos(x[lane]);
                let off = (sin[lane] - s).abs().max((cos[lane] - c).abs());
                assert!(off <= f64::EPSILON, "seed {seed}: {off} at {:e}", x[lane]);
            }
        }
        let [sin, cos, ..] = dispatch!(Level::new(), simd => all(simd, [0.0; LANES]));
        assert_eq!((sin[0], cos[0]), (0.0, 1.0));
    }

    #[test]
    fn the_short_exponential_is_the_exponential_on_its_interval() {
        let n = 100_000;
        for i in 0..=n {
            let x = -8.1 * f64::from(i) / f64::from(n);
            let [.., e] = dispatch!(Level::new(), simd => all(simd, [x; LANES]));
            let relative = e[0] / numerics::exp(x) - 1.0;
            assert!(relative.abs() < 1e-12, "{relative} at {x}");
        }
        let [.., e] = dispatch!(Level::new(), simd => all(simd, [0.0; LANES]));
        assert_eq!(e[0], 1.0);
    }

    #[test]
    fn rounding_down_gives_the_index_of_the_cell() {
        for x in [0.0, 0.2, 0.999_999_999_999, 1.0, 1.5, 2.5, 3.5, 1e6 + 0.5, 4_294_967_295.9] {
            let (down, index) = dispatch!(Level::new(), simd => {
                let down = floor(f64x8::splat(simd, x));
                (down[0], indices(down)[0])
            });
            assert_eq!((down, index), (x.floor(), x as usize));
        }
    }
}
