//! What every time is divided by: r, the time of a plain loop, taken in the same run.
//!
//! The loop sums 40 isotropic Gaussians at 112,000 points in single precision: the work of the term `cnc` for 2000
//! candidates of 56 states and 40 people, without any of its shortcuts. A machine that is twice as fast has half the
//! r, so ratios can be compared between machines. It uses the widest vectors that the machine has.
//!
//! The budgets of the project are stated in the time of the same loop in C, compiled with `gcc -O3 -march=native
//! -ffast-math` against glibc's vector exponential. Side by side on a machine with AVX-512 this loop took four fifths
//! of the time of the one in C (0.77 to 0.81 in four pairs), so a budget of 1 in C's time is 1.27 here.

use std::hint::black_box;
use std::time::{Duration, Instant};

use curionav_planning::random::{rng, uniform};
use fearless_simd::{Level, Simd, dispatch, f32x16, prelude::*};

const STATES: usize = 112_000;
const COMPONENTS: usize = 40;
/// Times that the loop runs before anything is compared with it.
const REPEATS: usize = 20;
/// -1 / (2 variance) and weight of every component.
const EXPONENT: f32 = -0.5 / 1.5;
const WEIGHT: f32 = 0.1;

/// Sixteen points and their sums. Aligned, so that the time does not depend on where memory is given out.
#[derive(Clone, Copy, Default)]
#[repr(align(64))]
struct Points {
    x: [f32; 16],
    y: [f32; 16],
    sum: [f32; 16],
}

/// The points and the means of the components.
pub(crate) struct Reference {
    points: Vec<Points>,
    means: Vec<(f32, f32)>,
    /// The least time so far: r.
    pub(crate) least: Duration,
}

impl Reference {
    /// Points and means spread over 30 m x 25 m.
    pub(crate) fn new() -> Self {
        let mut r = rng(1, 0);
        let mut draw = |most: f64| (most * uniform(&mut r)) as f32;
        let points = |_| Points {
            x: std::array::from_fn(|_| draw(30.0)),
            y: std::array::from_fn(|_| draw(25.0)),
            sum: [0.0; 16],
        };
        let points = (0..STATES / 16).map(points).collect();
        let means = (0..COMPONENTS).map(|_| (draw(30.0), draw(25.0))).collect();
        let mut reference = Self { points, means, least: Duration::MAX };
        (0..REPEATS).for_each(|_| reference.take_time());
        reference
    }

    /// Runs the loop once more.
    pub(crate) fn take_time(&mut self) {
        let started = Instant::now();
        self.run();
        black_box(&self.points);
        self.least = self.least.min(started.elapsed());
    }

    /// How many times as long as the loop something took.
    pub(crate) fn ratio(&self, time: Duration) -> f64 {
        time.as_secs_f64() / self.least.as_secs_f64()
    }

    #[inline(never)]
    fn run(&mut self) {
        dispatch!(Level::new(), simd => self.add_all(simd));
    }

    /// Component after component, as the loop in C, so that the sums go to memory and back for each of them.
    #[inline(always)]
    fn add_all<S: Simd>(&mut self, simd: S) {
        self.points.iter_mut().for_each(|points| points.sum = [0.0; 16]);
        for &(mx, my) in black_box(&self.means[..]) {
            for Points { x, y, sum } in &mut self.points {
                let dx = f32x16::from_slice(simd, x) - mx;
                let dy = f32x16::from_slice(simd, y) - my;
                let exponent = ((dx * dx + dy * dy) * EXPONENT).max(-80.0);
                (f32x16::from_slice(simd, sum) + exp(simd, exponent) * WEIGHT).store_slice(sum);
            }
        }
    }
}

/// e^x for -80 <= x <= 0, relative error below 3e-7: 2^n times the series of e^r, |r| <= ln(2) / 2.
#[inline(always)]
fn exp<S: Simd>(simd: S, x: f32x16<S>) -> f32x16<S> {
    // Adding and taking away 1.5 * 2^23 rounds to a whole number, whose bits are the lowest of the sum.
    const ROUND: f32 = 12_582_912.0;
    let shifted = x * std::f32::consts::LOG2_E + ROUND;
    let n = shifted - ROUND;
    let r = x - n * 0.693_145_75 - n * 1.428_606_8e-6;
    let mut series = f32x16::splat(simd, 1.0 / 720.0);
    for coefficient in [1.0 / 120.0, 1.0 / 24.0, 1.0 / 6.0, 0.5, 1.0, 1.0] {
        series = series * r + coefficient;
    }
    let bits: fearless_simd::i32x16<S> = shifted.bitcast();
    let power: f32x16<S> = ((bits + 127) << 23).bitcast();
    series * power
}

/// The loop computes what it says, so that it cannot become cheaper unseen.
pub(crate) fn check(reference: &mut Reference) -> anyhow::Result<()> {
    reference.run();
    for i in (0..STATES).step_by(997) {
        let (Points { x, y, sum }, lane) = (&reference.points[i / 16], i % 16);
        let density = |&(mx, my): &(f32, f32)| {
            let dx = f64::from(x[lane] - mx);
            let dy = f64::from(y[lane] - my);
            f64::from(WEIGHT) * (f64::from(EXPONENT) * (dx * dx + dy * dy)).max(-80.0).exp()
        };
        let (expected, found): (f64, _) = (reference.means.iter().map(density).sum(), f64::from(sum[lane]));
        anyhow::ensure!((found - expected).abs() <= 1e-5 * expected, "state {i}: {found}, not {expected}");
    }
    Ok(())
}
