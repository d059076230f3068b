//! What [`crate::numerics`] takes from the library, eight at a time, bit for bit.
//!
//! The library's functions choose between formulas by the size of a number. Here each lane gets the result of the same
//! operations in the same order, by selection; lanes with numbers that are rare ask the library.

use super::*;
use crate::geometry;
use fearless_simd::mask64x8;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, LOG2_E, PI, TAU};

/// The lanes of `results`, but those that are not `usual` as `exact` gives them.
#[inline(always)]
fn unless<S: Simd>(usual: mask64x8<S>, mut results: f64x8<S>, exact: impl Fn(usize) -> f64) -> f64x8<S> {
    if !usual.all_true() {
        let usual = usual.to_bitmask();
        for lane in (0..LANES).filter(|lane| usual >> lane & 1 == 0) {
            results[lane] = exact(lane);
        }
    }
    results
}

/// The sum of the coefficients times powers of `z`, the lowest first.
#[inline(always)]
fn rising<S: Simd, const N: usize>(z: f64x8<S>, coefficients: [f64; N]) -> f64x8<S> {
    let mut sum = f64x8::splat(z.simd, coefficients[N - 1]);
    for k in (0..N - 1).rev() {
        sum = coefficients[k] + z * sum;
    }
    sum
}

/// [`numerics::atan2`].
#[inline(always)]
pub(crate) fn atan2<S: Simd>(y: f64x8<S>, x: f64x8<S>) -> f64x8<S> {
    const PI_LOW: f64 = 1.224_646_799_147_353_2e-16;
    let all = |number: f64| f64x8::splat(x.simd, number);
    let ratio = (y / x).abs();
    let angle = atan(ratio);
    let angle = x.simd_lt(0.0).select(all(PI) - (angle - PI_LOW), angle).copysign(y);
    // The others are so near to an axis, or so far away, that the library knows the result.
    let usual = ratio.simd_le(1e15) & (ratio.simd_ge(1e-15) | y.simd_eq(0.0));
    unless(usual, angle, |lane| numerics::atan2(y[lane], x[lane]))
}

/// The angle whose tangent is `x`, which is not negative: taken from that of 0, 1/2, 1, 3/2 or infinity, whichever is
/// near.
#[inline(always)]
fn atan<S: Simd>(x: f64x8<S>) -> f64x8<S> {
    const ODD: [f64; 6] = [
        0.333_333_333_333_329_3,
        0.142_857_142_725_034_66,
        0.090_908_871_334_365_07,
        0.066_610_731_373_875_31,
        0.049_768_779_946_159_324,
        0.016_285_820_115_365_782,
    ];
    const EVEN: [f64; 5] = [
        -0.199_999_999_998_764_83,
        -0.111_111_104_054_623_56,
        -0.076_918_762_050_448_3,
        -0.058_335_701_337_905_735,
        -0.036_531_572_744_216_916,
    ];
    let all = |number: f64| f64x8::splat(x.simd, number);
    // Dividend, divisor, and the angle in two parts.
    let mut near = [all(-1.0), x, all(FRAC_PI_2), all(6.123_233_995_736_766e-17)];
    let others = [
        (2.4375, [x - 1.5, 1.0 + x * 1.5, all(0.982_793_723_247_329), all(1.390_331_103_123_099_8e-17)]),
        (1.1875, [x - 1.0, x + 1.0, all(FRAC_PI_4), all(3.061_616_997_868_383e-17)]),
        (0.6875, [x * 2.0 - 1.0, x + 2.0, all(0.463_647_609_000_806_1), all(2.269_877_745_296_168_7e-17)]),
        (0.4375, [x, all(1.0), all(0.0), all(0.0)]),
    ];
    for (below, other) in others {
        let is_below = x.simd_lt(below);
        for k in 0..4 {
            near[k] = is_below.select(other[k], near[k]);
        }
    }
    let [dividend, divisor, high, low] = near;
    let x = dividend / divisor;
    let z = x * x;
    let w = z * z;
    let odd = z * rising(w, ODD);
    let even = w * rising(w, EVEN);
    high - (x * (odd + even) - low - x)
}

/// [`geometry::wrap_angle`].
#[inline(always)]
pub(crate) fn wrap_angle<S: Simd>(angle: f64x8<S>) -> f64x8<S> {
    let less = angle.simd_gt(PI).select(angle - TAU, angle);
    let wrapped = angle.simd_le(-PI).select(angle + TAU, less);
    unless(angle.abs().simd_lt(TAU), wrapped, |lane| geometry::wrap_angle(angle[lane]))
}

/// `sin(x) / x` and `cos(x)` for any angle: [`numerics::sinc_cos`], and where that takes none so wide the library's.
#[inline(always)]
pub(crate) fn sinc_cos<S: Simd>(x: f64x8<S>) -> (f64x8<S>, f64x8<S>) {
    let (sinc, cosine) = numerics::sinc_cos(x);
    let is_wide = x.abs().simd_gt(numerics::SMALL_ANGLE);
    if !is_wide.any_true() {
        return (sinc, cosine);
    }
    let (sin, cos) = sin_cos(x);
    (is_wide.select(sin / x, sinc), is_wide.select(cos, cosine))
}

/// Sine and cosine of [`numerics::sin_cos`], fastest for angles up to half a turn to either side.
#[inline(always)]
pub(crate) fn sin_cos<S: Simd>(x: f64x8<S>) -> (f64x8<S>, f64x8<S>) {
    // Up to the first of these no quarter turn is taken off, up to the second one, up to the third two.
    let [none, one, two] = [0x3fe9_21fc, 0x4002_d97d, 0x400f_6a7b].map(upper);
    // So near to one or two quarter turns the library takes them off in more parts.
    let [low_1, high_1, low_2, high_2] = [0x3ff9_21fb, 0x3ff9_21fc, 0x4009_21fb, 0x4009_21fc].map(upper);
    const QUARTER: [f64; 2] = [1.570_796_326_734_125_6, 6.077_100_506_506_192e-11];
    const SINE: [f64; 6] = [
        -0.166_666_666_666_666_32,
        0.008_333_333_333_322_49,
        -0.000_198_412_698_298_579_5,
        2.755_731_370_707_006_8e-6,
        -2.505_076_025_340_686_3e-8,
        1.589_690_995_211_55e-10,
    ];
    const COSINE: [f64; 6] = [
        0.041_666_666_666_666_6,
        -0.001_388_888_888_887_411,
        2.480_158_728_947_673e-5,
        -2.755_731_435_139_066_3e-7,
        2.087_572_321_298_175e-9,
        -1.135_964_755_778_819_5e-11,
    ];
    let all = |number: f64| f64x8::splat(x.simd, number);
    let size = x.abs();
    let is_small = size.simd_lt(none);
    let is_first = size.simd_lt(one);
    let side = all(1.0).copysign(x);
    let quarters = is_small.select(all(0.0), is_first.select(side, side * 2.0));
    let r = x - quarters * QUARTER[0];
    let w = quarters * QUARTER[1];
    let y = r - w;
    let rest = (r - y) - w;

    let z = y * y;
    let w = z * z;
    let v = z * y;
    let r = SINE[1] + z * (SINE[2] + z * SINE[3]) + z * w * (SINE[4] + z * SINE[5]);
    let reduced = y - ((z * (rest * 0.5 - v * r) - rest) - v * SINE[0]);
    let sine = is_small.select(y + v * (SINE[0] + z * r), reduced);
    let r = z * rising(z, [COSINE[0], COSINE[1], COSINE[2]])
        + w * w * rising(z, [COSINE[3], COSINE[4], COSINE[5]]);
    let half = z * 0.5;
    let most = 1.0 - half;
    let cosine = most + (((1.0 - most) - half) + (z * r - y * rest));

    // So small an angle is its own sine, also if it is zero with a sign.
    let is_tiny = size.simd_lt(upper(0x3e46_a09e));
    let mut sin = is_tiny.select(x, is_small.select(sine, is_first.select(cosine * side, -sine)));
    let mut cos = is_small.select(cosine, is_first.select(-(sine * side), -cosine));
    let is_near = (size.simd_ge(low_1) & size.simd_lt(high_1)) | (size.simd_ge(low_2) & size.simd_lt(high_2));
    let usual = size.simd_lt(two) & !is_near;
    if !usual.all_true() {
        let usual = usual.to_bitmask();
        for lane in (0..LANES).filter(|lane| usual >> lane & 1 == 0) {
            (sin[lane], cos[lane]) = numerics::sin_cos(x[lane]);
        }
    }
    (sin, cos)
}

/// [`numerics::exp`], fastest between -700 and 0.
#[inline(always)]
pub(crate) fn exp<S: Simd>(x: f64x8<S>) -> f64x8<S> {
    const LN_2: [f64; 2] = [0.693_147_180_369_123_8, 1.908_214_929_270_587_7e-10];
    const P: [f64; 5] = [
        0.166_666_666_666_666_02,
        -0.002_777_777_777_701_559_3,
        6.613_756_321_437_934e-5,
        -1.653_390_220_546_525_2e-6,
        4.138_136_797_057_238_5e-8,
    ];
    let all = |number: f64| f64x8::splat(x.simd, number);
    let size = x.abs();
    // The power of two to take off, changed in sign.
    let halved = size.simd_ge(upper(0x3ff0_a2b2)).select(floor(size * LOG2_E + 0.5), all(1.0));
    let halved = size.simd_lt(upper(0x3fd6_2e43)).select(all(0.0), halved);
    let high = x + halved * LN_2[0];
    let low = -halved * LN_2[1];
    let r = high - low;
    let z = r * r;
    let c = r - z * rising(z, P);
    let y = 1.0 + (r * c / (2.0 - c) - low + high);
    let power: u64x8<S> = ((1023.0 - halved) + WHOLE).bitcast();
    let scaled = y * (power << 52).bitcast::<f64x8<S>>();
    let close = size.simd_lt(upper(0x3e30_0001)).select(x + 1.0, scaled);
    unless(x.simd_ge(-700.0) & x.simd_le(0.0), close, |lane| numerics::exp(x[lane]))
}

/// [`numerics::erf`].
#[inline(always)]
pub(crate) fn erf<S: Simd>(x: f64x8<S>) -> f64x8<S> {
    const P: [f64; 5] = [
        0.128_379_167_095_512_56,
        -0.325_042_107_247_001_5,
        -0.028_481_749_575_598_51,
        -0.005_770_270_296_489_442,
        -2.376_301_665_665_016_3e-5,
    ];
    const Q: [f64; 6] = [
        1.0,
        0.397_917_223_959_155_35,
        0.065_022_249_988_767_3,
        0.005_081_306_281_875_766,
        0.000_132_494_738_004_321_64,
        -3.960_228_278_775_368e-6,
    ];
    // Between 0.84375 and 1.25, in powers of what is above 1.
    const AT_1: f64 = 0.845_062_911_510_467_5;
    const PA: [f64; 7] = [
        -0.002_362_118_560_752_659_4,
        0.414_856_118_683_748_33,
        -0.372_207_876_035_701_3,
        0.318_346_619_901_161_75,
        -0.110_894_694_282_396_68,
        0.035_478_304_325_618_236,
        -0.002_166_375_594_868_791,
    ];
    const QA: [f64; 7] = [
        1.0,
        0.106_420_880_400_844_23,
        0.540_397_917_702_171,
        0.071_828_654_414_196_27,
        0.126_171_219_808_761_64,
        0.013_637_083_912_029_05,
        0.011_984_499_846_799_107,
    ];
    let size = x.abs();
    let z = x * x;
    let y = x + x * (rising(z, P) / rising(z, Q));
    let is_small = size.simd_lt(upper(0x3feb_0000));
    let is_far = size.simd_ge(upper(0x3ff4_0000));
    let usual = size.simd_ge(1e-8) & size.simd_lt(f64::INFINITY);
    if is_small.all_true() {
        return unless(usual, y, |lane| numerics::erf(x[lane]));
    }
    let s = size - 1.0;
    let mut larger = 1.0 - ((1.0 - AT_1) - rising(s, PA) / rising(s, QA));
    if is_far.any_true() {
        let beyond = 1.0 - erfc(is_far.select(size, f64x8::splat(x.simd, 2.0)));
        larger = is_far.select(beyond, larger);
    }
    let y = is_small.select(y, larger.copysign(x));
    unless(usual, y, |lane| numerics::erf(x[lane]))
}

/// One less the error function, from 1.25 on; from 6 on it is too small to count beside one.
#[inline(always)]
fn erfc<S: Simd>(x: f64x8<S>) -> f64x8<S> {
    // Below 1 / 0.35, and beyond, where there is one coefficient less.
    const R: [[f64; 8]; 2] = [
        [
            -0.009_864_944_034_847_148,
            -0.693_858_572_707_181_8,
            -10.558_626_225_323_291,
            -62.375_332_450_326_006,
            -162.396_669_462_573_47,
            -184.605_092_906_711_04,
            -81.287_435_506_306_6,
            -9.814_329_344_169_145,
        ],
        [
            -0.009_864_942_924_700_1,
            -0.799_283_237_680_523,
            -17.757_954_917_754_752,
            -160.636_384_855_821_92,
            -637.566_443_368_389_6,
            -1_025.095_131_611_077_2,
            -483.519_191_608_651_4,
            0.0,
        ],
    ];
    const T: [[f64; 9]; 2] = [
        [
            1.0,
            19.651_271_667_439_257,
            137.657_754_143_519_04,
            434.565_877_475_229_23,
            645.387_271_733_267_9,
            429.008_140_027_567_83,
            108.635_005_541_779_44,
            6.570_249_770_319_282,
            -0.060_424_415_214_858_1,
        ],
        [
            1.0,
            30.338_060_743_482_46,
            325.792_512_996_573_9,
            1_536.729_586_084_437,
            3_199.858_219_508_595_5,
            2_553.050_406_433_164_4,
            474.528_541_206_955_37,
            -22.440_952_446_585_82,
            0.0,
        ],
    ];
    let all = |number: f64| f64x8::splat(x.simd, number);
    let is_near = x.simd_lt(upper(0x4006_db6d));
    let either = |[near, far]: [f64; 2]| is_near.select(all(near), all(far));
    let s = 1.0 / (x * x);
    let mut r = either([R[0][7], R[1][7]]);
    let mut big = either([T[0][8], T[1][8]]);
    for k in (0..7).rev() {
        r = either([R[0][k], R[1][k]]) + s * r;
    }
    for k in (0..8).rev() {
        big = either([T[0][k], T[1][k]]) + s * big;
    }
    let bits: u64x8<S> = x.bitcast();
    let z: f64x8<S> = (bits & 0xffff_ffff_0000_0000).bitcast();
    let tail = exp(-z * z - 0.5625) * exp((z - x) * (z + x) + r / big) / x;
    x.simd_lt(6.0).select(tail, all(0.0))
}

/// The least positive number with these upper 32 bits.
const fn upper(bits: u64) -> f64 {
    f64::from_bits(bits << 32)
}

#[cfg(test)]
mod tests {
    use super::super::tests::levels;
    use super::*;
    use crate::random::{Rng, rng, uniform};

    /// Numbers of all sizes and signs, and those at which formulas change, with their neighbours.
    fn numbers(r: &mut Rng) -> [f64; LANES] {
        let edges = [
            0.0,
            0.4375,
            0.6875,
            1.1875,
            2.4375,
            0.84375,
            1.0,
            PI,
            TAU,
            0.5 * PI,
            0.75 * PI,
            1.25 * PI,
            6.0,
            700.0,
            0.5 * std::f64::consts::LN_2,
            1.5 * std::f64::consts::LN_2,
            f64::INFINITY,
            f64::NAN,
            1e-300,
            1e300,
            upper(0x3fe9_21fb),
            upper(0x3ff4_0000),
            upper(0x4006_db6d),
            upper(0x3ff9_21fb),
            upper(0x3ff9_21fc),
            upper(0x4002_d97c),
            upper(0x4009_21fb),
            upper(0x4009_21fc),
            upper(0x400f_6a7a),
            upper(0x3e46_a09e),
            upper(0x3e30_0000),
            upper(0x3e30_0001),
            upper(0x3ff0_a2b2),
            upper(0x3fd6_2e42),
            upper(0x3fd6_2e43),
        ];
        std::array::from_fn(|_| {
            let size = match (6.0 * uniform(r)) as u32 {
                0 => {
                    let edge: f64 = edges[(uniform(r) * edges.len() as f64) as usize];
                    f64::from_bits((edge.to_bits() + (3.0 * uniform(r)) as u64).saturating_sub(1))
                }
                1 => 10.0_f64.powf(40.0 * uniform(r) - 20.0),
                2 => 10.0 * uniform(r),
                _ => 4.0 * uniform(r),
            };
            if uniform(r) < 0.5 { size } else { -size }
        })
    }

    /// Makes the vector instructions usable in here: a closure could not.
    #[inline(always)]
    fn all<S: Simd>(simd: S, a: [f64; LANES], b: [f64; LANES]) -> [[f64; LANES]; 6] {
        let a = f64x8::load_array(simd, a);
        let b = f64x8::load_array(simd, b);
        let (sin, cos) = sin_cos(a);
        [atan2(a, b), wrap_angle(a), sin, cos, exp(a), erf(a)].map(Into::into)
    }

    #[test]
    fn every_lane_has_the_bits_of_the_library() {
        let seed = 5;
        let mut r = rng(seed, 0);
        for _ in 0..100_000 {
            let a = numbers(&mut r);
            let b = numbers(&mut r);
            let same_bits = |found: f64, expected: f64, of: &str, lane: usize| {
                let same = found.to_bits() == expected.to_bits() || (found.is_nan() && expected.is_nan());
                assert!(
                    same,
                    "seed {seed}: {found:e}, not {expected:e}: {of} of {:e}, {:e}",
                    a[lane], b[lane]
                );
            };
            for level in levels() {
                let found = dispatch!(level, simd => all(simd, a, b));
                for lane in 0..LANES {
                    let x = a[lane];
                    let (sin, cos) = numerics::sin_cos(a[lane]);
                    same_bits(found[0][lane], numerics::atan2(x, b[lane]), "arc tangent", lane);
                    same_bits(found[1][lane], geometry::wrap_angle(x), "wrapped angle", lane);
                    same_bits(found[2][lane], sin, "sine", lane);
                    same_bits(found[3][lane], cos, "cosine", lane);
                    same_bits(found[4][lane], numerics::exp(x), "exponential", lane);
                    same_bits(found[5][lane], numerics::erf(x), "error function", lane);
                }
            }
        }
    }
}
