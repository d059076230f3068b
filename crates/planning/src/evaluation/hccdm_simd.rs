//! The hot loop of [`super::hccdm`]: many Gaussians along a trajectory, eight states at a time.
//!
//! A trajectory is cut into runs of eight states. Those lie close together, so most components are
//! discarded for a whole run by one comparison; the others are added lane by lane with the same
//! operations in the same order whatever else is in the batch.

use crate::geometry::Point2;
use crate::numerics::exp_minus_8_to_0;

/// A component is exactly zero farther from its mean than this many standard deviations: there it has
/// fallen to e^-8 = 0.0003 of its peak, and what is far away costs no time.
pub const CUT_SIGMAS: f64 = 4.0;
/// States handled together.
const WIDTH: usize = 8;

/// One Gaussian component at one moment.
#[derive(Debug, Clone, Copy)]
pub(super) struct State {
    mean: Point2,
    /// -1 / (2 variance), 1/m2.
    exponent: f64,
    /// Weight over 2 pi variance: the density at the mean, 1/m2.
    peak: f64,
    /// Squared distance beyond which it is zero, m2.
    cut: f64,
}

impl State {
    pub(super) fn new(mean: Point2, variance: f64, weight: f64) -> Self {
        Self {
            mean,
            exponent: -0.5 / variance,
            // |Sigma|^(1/2) of an isotropic 2x2 covariance is its variance
            peak: weight / (std::f64::consts::TAU * variance),
            cut: CUT_SIGMAS * CUT_SIGMAS * variance,
        }
    }

    /// Nothing anywhere: fills the lanes beyond the last state.
    const NOTHING: Self = Self { mean: Point2::new(0.0, 0.0), exponent: 0.0, peak: 0.0, cut: -1.0 };
}

/// A component over eight consecutive states.
#[derive(Debug, Clone)]
struct Run {
    x: [f64; WIDTH],
    y: [f64; WIDTH],
    exponent: [f64; WIDTH],
    peak: [f64; WIDTH],
    cut: [f64; WIDTH],
}

impl Run {
    fn new(states: [State; WIDTH]) -> Self {
        Self {
            x: states.map(|s| s.mean.x),
            y: states.map(|s| s.mean.y),
            exponent: states.map(|s| s.exponent),
            peak: states.map(|s| s.peak),
            cut: states.map(|s| s.cut),
        }
    }

    /// Adds the component's value at each of eight points.
    #[inline]
    fn add(&self, x: &[f64; WIDTH], y: &[f64; WIDTH], sum: &mut [f64; WIDTH]) {
        for lane in 0..WIDTH {
            let (dx, dy) = (x[lane] - self.x[lane], y[lane] - self.y[lane]);
            let squared = dx * dx + dy * dy;
            let value = self.peak[lane] * exp_minus_8_to_0(self.exponent[lane] * squared);
            sum[lane] += if squared <= self.cut[lane] { value } else { 0.0 };
        }
    }
}

/// A disc that holds everything a component touches during a run.
#[derive(Debug, Clone, Copy)]
struct Reach {
    x: f64,
    y: f64,
    radius: f64,
}

impl Reach {
    fn new(states: &[State]) -> Self {
        let hull = enclose(states.iter().map(|s| (s.mean.x, s.mean.y)));
        let cut = states.iter().map(|s| s.cut.sqrt()).fold(0.0, f64::max);
        // the slack covers rounding: a run is discarded only when each of its lanes would be cut
        Self { radius: (hull.radius + cut) * (1.0 + 1e-9) + 1e-9, ..hull }
    }
}

/// A small disc around points: centre of the bounding box, half its diagonal.
fn enclose(points: impl Iterator<Item = (f64, f64)>) -> Reach {
    let (mut low, mut high) = ((f64::INFINITY, f64::INFINITY), (f64::NEG_INFINITY, f64::NEG_INFINITY));
    for (x, y) in points {
        low = (low.0.min(x), low.1.min(y));
        high = (high.0.max(x), high.1.max(y));
    }
    let (w, h) = (high.0 - low.0, high.1 - low.1);
    Reach { x: low.0 + 0.5 * w, y: low.1 + 0.5 * h, radius: 0.5 * (w * w + h * h).sqrt() }
}

/// All components over the whole horizon: `[run, component]`.
#[derive(Debug, Clone)]
pub(super) struct Lanes {
    components: usize,
    steps: usize,
    runs: Vec<Run>,
    reach: Vec<Reach>,
}

impl Lanes {
    /// Lays out `state(component, step)`.
    pub(super) fn new(steps: usize, components: usize, state: impl Fn(usize, usize) -> State) -> Self {
        let mut runs = Vec::with_capacity(steps.div_ceil(WIDTH) * components);
        let mut reach = Vec::with_capacity(runs.capacity());
        for first in (0..steps).step_by(WIDTH) {
            let used = WIDTH.min(steps - first);
            for g in 0..components {
                let mut states = [State::NOTHING; WIDTH];
                for (lane, s) in states[..used].iter_mut().enumerate() {
                    *s = state(g, first + lane);
                }
                reach.push(Reach::new(&states[..used]));
                runs.push(Run::new(states));
            }
        }
        Self { components, steps, runs, reach }
    }

    /// Sum over the states of the sum over the components, each in ascending order.
    pub(super) fn sum(&self, x: &[f64], y: &[f64]) -> f64 {
        let mut total = 0.0;
        for (r, first) in (0..self.steps).step_by(WIDTH).enumerate() {
            let used = WIDTH.min(self.steps - first);
            let (mut px, mut py) = ([0.0; WIDTH], [0.0; WIDTH]);
            px[..used].copy_from_slice(&x[first..first + used]);
            py[..used].copy_from_slice(&y[first..first + used]);
            let here = enclose(px[..used].iter().copied().zip(py[..used].iter().copied()));
            let mut densities = [0.0; WIDTH];
            let row = r * self.components..(r + 1) * self.components;
            for (run, reach) in self.runs[row.clone()].iter().zip(&self.reach[row]) {
                let (dx, dy, far) = (reach.x - here.x, reach.y - here.y, reach.radius + here.radius);
                if dx * dx + dy * dy <= far * far {
                    run.add(&px, &py, &mut densities);
                }
            }
            for density in &densities[..used] {
                total += density;
            }
        }
        total
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    impl State {
        /// The component's value at `p`, 1/m2.
        pub(in crate::evaluation) fn density(&self, p: Point2) -> f64 {
            let (dx, dy) = (p.x - self.mean.x, p.y - self.mean.y);
            let squared = dx * dx + dy * dy;
            if squared <= self.cut { self.peak * exp_minus_8_to_0(self.exponent * squared) } else { 0.0 }
        }
    }
}
