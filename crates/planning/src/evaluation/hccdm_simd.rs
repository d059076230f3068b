//! The hot loop of [`super::hccdm`]: many Gaussians along a trajectory, eight states at a time.
//!
//! A trajectory is cut into runs of eight states. Those lie close together, so most components are
//! discarded for a whole run by one comparison; the others are added lane by lane with the same
//! operations in the same order whatever else is in the batch.

use std::ops::Range;

use crate::geometry::Point2;
use crate::lanes::{LANES, Level, Select, Simd, SimdBase, SimdMask, dispatch, exp_minus_8_to_0, f64x8};
use crate::sight::{InView, Shares, View};

/// A component is exactly zero farther from its mean than this many standard deviations: there it has
/// fallen to e^-8 = 0.0003 of its peak, and what is far away costs no time. A flat one has fallen as far at 2.6.
pub const CUT_SIGMAS: f64 = 4.0;

crate::parameters! {
    /// How a component falls off with the distance d from its mean, Sigma_g = sigma^2 I. Both hold p_g people.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum Kernel {
        /// The Gaussian of eq. 16.
        #[default]
        Gaussian,
        /// p_g (ln 2)^(1/2) / (pi^(3/2) sigma^2) 2^-q^2 with q = d^2 / (2 sigma^2), a generalised normal distribution
        /// (Subbotin, 1923): even near people, so that all places beside them are alike, steep at 2^(1/2) sigma, where
        /// half of it is left, and nothing farther away.
        Flat,
    }
}

impl Kernel {
    /// What a component of height one holds that is even in a convex hull and falls off around it, m2: the integral
    /// over the plane, by Steiner's formula for the strips of the hull's surroundings. `variance` is that of a point's
    /// component, m2, and the hull has this area, m2, and perimeter, metres.
    pub(super) fn held(self, variance: f64, area: f64, perimeter: f64) -> f64 {
        // Integrals over the distance d of the kernel and of 2 pi d times it.
        let (strip, point) = match self {
            Self::Gaussian => {
                ((0.5 * std::f64::consts::PI * variance).sqrt(), std::f64::consts::TAU * variance)
            }
            Self::Flat => {
                let half = std::f64::consts::LN_2.sqrt();
                let strip = GAMMA_5_4 * (2.0 * variance / half).sqrt();
                (strip, std::f64::consts::TAU * variance / (half * std::f64::consts::FRAC_2_SQRT_PI))
            }
        };
        area + perimeter * strip + point
    }
}

/// Euler's gamma function at 5/4, the integral of exp(-u^4) over u > 0.
const GAMMA_5_4: f64 = 0.906_402_477_055_477;

/// One component at one moment.
#[derive(Debug, Clone)]
pub(super) struct State {
    mean: Point2,
    /// What the squared distance is multiplied with, 1/m2: -1 / (2 variance), or, of a flat one whose product is
    /// squared, the (ln 2)^(1/2)th of it.
    exponent: f64,
    /// The density at the mean, 1/m2.
    peak: f64,
    /// Squared distance beyond which it is zero, m2.
    cut: f64,
    /// The convex hull from which distances count; none where they count from the mean.
    hull: Vec<Point2>,
}

impl State {
    pub(super) fn new(kernel: Kernel, mean: Point2, variance: f64, weight: f64) -> Self {
        // |Sigma|^(1/2) of an isotropic 2x2 covariance is its variance
        let exponent = -0.5 / variance;
        let peak = weight / (std::f64::consts::TAU * variance);
        if kernel == Kernel::Gaussian {
            let cut = CUT_SIGMAS * CUT_SIGMAS * variance;
            return Self { mean, exponent, peak, cut, hull: Vec::new() };
        }
        let half = std::f64::consts::LN_2.sqrt();
        let exponent = exponent * half;
        let peak = peak * half * std::f64::consts::FRAC_2_SQRT_PI;
        Self { mean, exponent, peak, cut: -f64::sqrt(8.0) / exponent, hull: Vec::new() }
    }

    /// One that has the density `peak` all over a hull, 1/m2, and falls off around it.
    pub(super) fn of_hull(kernel: Kernel, hull: Vec<Point2>, variance: f64, peak: f64) -> Self {
        Self { peak, hull, ..Self::new(kernel, Point2::default(), variance, 1.0) }
    }

    /// Nothing anywhere: fills the lanes beyond the last state.
    const NOTHING: Self =
        Self { mean: Point2::new(0.0, 0.0), exponent: 0.0, peak: 0.0, cut: -1.0, hull: Vec::new() };

    /// The points from which distances count.
    fn corners(&self) -> &[Point2] {
        if self.hull.is_empty() { std::slice::from_ref(&self.mean) } else { &self.hull }
    }
}

/// A component over eight consecutive states.
#[derive(Debug, Clone)]
#[repr(align(64))]
struct Run {
    x: [f64; LANES],
    y: [f64; LANES],
    exponent: [f64; LANES],
    peak: [f64; LANES],
    cut: [f64; LANES],
}

impl Run {
    fn new(states: &[State; LANES]) -> Self {
        Self {
            x: states.each_ref().map(|s| s.mean.x),
            y: states.each_ref().map(|s| s.mean.y),
            exponent: states.each_ref().map(|s| s.exponent),
            peak: states.each_ref().map(|s| s.peak),
            cut: states.each_ref().map(|s| s.cut),
        }
    }

    /// The component's value at each of eight points, where it has these edges.
    #[inline(always)]
    fn at<S: Simd>(&self, kernel: Kernel, edges: &[Edge], x: f64x8<S>, y: f64x8<S>) -> f64x8<S> {
        let squared = if edges.is_empty() {
            let dx = x - lanes(x.simd, &self.x);
            let dy = y - lanes(x.simd, &self.y);
            dx * dx + dy * dy
        } else {
            Edge::squared_distance(edges, x, y)
        };
        let exponent = lanes(x.simd, &self.exponent) * squared;
        let exponent = if kernel == Kernel::Flat { -(exponent * exponent) } else { exponent };
        let value = lanes(x.simd, &self.peak) * exp_minus_8_to_0(exponent);
        squared.simd_le(lanes(x.simd, &self.cut)).select(value, f64x8::splat(x.simd, 0.0))
    }
}

/// An edge of a component's hull over eight consecutive states, from one corner to the next one counter-clockwise.
#[derive(Debug, Clone)]
#[repr(align(64))]
struct Edge {
    x: [f64; LANES],
    y: [f64; LANES],
    dx: [f64; LANES],
    dy: [f64; LANES],
    /// One through its squared length, 1/m2; 0 if it has none.
    inverse: [f64; LANES],
}

impl Edge {
    /// The edges of the hulls of eight states; none if these have no hulls.
    fn all(states: &[State; LANES]) -> Vec<Self> {
        let most = states.iter().map(|state| state.hull.len()).max().unwrap_or(0);
        (0..most).map(|number| Self::new(states, number)).collect()
    }

    /// Edge `number` of each. One that does not have so many has its first again, which changes no distance.
    fn new(states: &[State; LANES], number: usize) -> Self {
        let ends = states.each_ref().map(|state| {
            let corners = state.corners();
            let from = if number < corners.len() { number } else { 0 };
            [corners[from], corners[(from + 1) % corners.len()]]
        });
        let dx = ends.map(|[from, to]| to.x - from.x);
        let dy = ends.map(|[from, to]| to.y - from.y);
        let inverse = std::array::from_fn(|lane| {
            let squared = dx[lane] * dx[lane] + dy[lane] * dy[lane];
            if squared > 0.0 { 1.0 / squared } else { 0.0 }
        });
        Self { x: ends.map(|[from, _]| from.x), y: ends.map(|[from, _]| from.y), dx, dy, inverse }
    }

    /// Squared distance of each of eight points from the hull with these edges, m2: 0 inside.
    #[inline(always)]
    fn squared_distance<S: Simd>(edges: &[Self], x: f64x8<S>, y: f64x8<S>) -> f64x8<S> {
        let simd = x.simd;
        let zero = f64x8::splat(simd, 0.0);
        let mut nearest = f64x8::splat(simd, f64::INFINITY);
        // A point is inside if it is to the left of every edge. Nothing is inside a hull of two corners.
        let mut leftmost = f64x8::splat(simd, f64::INFINITY);
        for edge in edges {
            let dx = lanes(simd, &edge.dx);
            let dy = lanes(simd, &edge.dy);
            let from_x = x - lanes(simd, &edge.x);
            let from_y = y - lanes(simd, &edge.y);
            leftmost = leftmost.min(dx * from_y - dy * from_x);
            let share = (from_x * dx + from_y * dy) * lanes(simd, &edge.inverse);
            let share = share.max(zero).min(f64x8::splat(simd, 1.0));
            let off_x = from_x - share * dx;
            let off_y = from_y - share * dy;
            nearest = nearest.min(off_x * off_x + off_y * off_y);
        }
        leftmost.simd_gt(zero).select(zero, nearest)
    }
}

#[inline(always)]
fn lanes<S: Simd>(simd: S, of: &[f64; LANES]) -> f64x8<S> {
    f64x8::load_array_ref(simd, of)
}

/// A disc around the centre of a box, as wide as the box.
#[derive(Debug, Clone, Copy)]
struct Disc {
    x: f64,
    y: f64,
    radius: f64,
}

impl Disc {
    /// A small one around points.
    #[inline(always)]
    fn around(x: &[f64], y: &[f64]) -> Self {
        let span = |of: &[f64]| {
            let low = of.iter().copied().reduce(f64::min);
            let high = of.iter().copied().reduce(f64::max);
            (low.unwrap_or(0.0), high.unwrap_or(0.0))
        };
        let (left, right) = span(x);
        let (low, high) = span(y);
        let w = right - left;
        let h = high - low;
        Self { x: left + 0.5 * w, y: low + 0.5 * h, radius: 0.5 * (w * w + h * h).sqrt() }
    }

    /// One that holds everything a component touches during a run.
    fn reach(states: &[State]) -> Self {
        let (x, y): (Vec<f64>, Vec<f64>) = states.iter().flat_map(State::corners).map(|p| (p.x, p.y)).unzip();
        let hull = Self::around(&x, &y);
        let cut = states.iter().map(|s| s.cut.sqrt()).fold(0.0, f64::max);
        // the slack covers rounding: a run is discarded only when each of its lanes would be cut
        Self { radius: (hull.radius + cut) * (1.0 + 1e-9) + 1e-9, ..hull }
    }

    /// So far away that it touches nothing: takes the place of components beyond the last.
    const NOWHERE: Self = Self { x: f64::INFINITY, y: f64::INFINITY, radius: 0.0 };
}

/// Eight components over one run.
#[derive(Debug, Clone)]
struct Group {
    /// The discs that hold what each of them touches.
    x: [f64; LANES],
    y: [f64; LANES],
    radius: [f64; LANES],
    /// Fewer in the last group.
    runs: Vec<Run>,
    /// The edges of the hull of each, if it has one.
    edges: Vec<Vec<Edge>>,
}

impl Group {
    /// Which of them may touch something in `here`, lowest bit first.
    #[inline(always)]
    fn touching<S: Simd>(&self, simd: S, here: Disc) -> u64 {
        let dx = lanes(simd, &self.x) - here.x;
        let dy = lanes(simd, &self.y) - here.y;
        let far = lanes(simd, &self.radius) + here.radius;
        (dx * dx + dy * dy).simd_le(far * far).to_bitmask()
    }
}

/// All components over the whole horizon.
#[derive(Debug, Clone)]
pub(super) struct Lanes {
    steps: usize,
    /// How the components fall off.
    kernel: Kernel,
    /// One through the density at which half of it counts, m2; zero if all of it does.
    temper: f64,
    /// The groups of each run of eight states.
    groups: Vec<Vec<Group>>,
}

impl Lanes {
    /// Lays out `state(component, step)`.
    pub(super) fn new(
        steps: usize,
        (kernel, temper): (Kernel, f64),
        components: usize,
        state: impl Fn(usize, usize) -> State,
    ) -> Self {
        let group = |first: usize, g: usize| {
            let used = LANES.min(steps - first);
            let mut reach = [Disc::NOWHERE; LANES];
            let mut runs = Vec::new();
            let mut edges = Vec::new();
            for component in g..components.min(g + LANES) {
                let mut states = [const { State::NOTHING }; LANES];
                for (lane, s) in states[..used].iter_mut().enumerate() {
                    *s = state(component, first + lane);
                }
                reach[runs.len()] = Disc::reach(&states[..used]);
                runs.push(Run::new(&states));
                edges.push(Edge::all(&states));
            }
            Group {
                x: reach.map(|r| r.x),
                y: reach.map(|r| r.y),
                radius: reach.map(|r| r.radius),
                runs,
                edges,
            }
        };
        let of_run = |first| (0..components).step_by(LANES).map(|g| group(first, g)).collect();
        Self { steps, kernel, temper, groups: (0..steps).step_by(LANES).map(of_run).collect() }
    }

    /// Of each trajectory the sum over its states of the sum over the components, each in ascending order. `x` and
    /// `y` are `[trajectory, step]`. A component counts as far as `view` has it in view.
    pub(super) fn sums(
        &self,
        level: Level,
        x: &[f64],
        y: &[f64],
        mut view: Option<&mut View<'_>>,
    ) -> Vec<f64> {
        let mut totals = vec![0.0; x.len() / self.steps];
        let view = &mut view;
        dispatch!(level, simd => self.add_all(simd, x, y, view, &mut totals));
        totals
    }

    /// Run after run, so that its components stay in the cache.
    #[inline(always)]
    fn add_all<S: Simd>(
        &self,
        simd: S,
        x: &[f64],
        y: &[f64],
        view: &mut Option<&mut View<'_>>,
        totals: &mut [f64],
    ) {
        for (groups, first) in self.groups.iter().zip((0..self.steps).step_by(LANES)) {
            let used = LANES.min(self.steps - first);
            for (i, total) in totals.iter_mut().enumerate() {
                let all = i * self.steps..(i + 1) * self.steps;
                let places = places(view, first..first + used, &x[all.clone()], &y[all.clone()]);
                let start = all.start + first;
                let x = &x[start..start + used];
                let y = &y[start..start + used];
                let here = Disc::around(x, y);
                let padded = |of: &[f64]| f64x8::from_fn(simd, |lane| of[lane.min(used - 1)]);
                let x = padded(x);
                let y = padded(y);
                let mut densities = f64x8::splat(simd, 0.0);
                for (eight, group) in groups.iter().enumerate() {
                    let mut touching = group.touching(simd, here);
                    let in_view = match view {
                        Some(view) if touching != 0 => view.of_eight(places, eight, touching),
                        _ => InView::ALL,
                    };
                    while touching != 0 {
                        let component = touching.trailing_zeros() as usize;
                        touching &= touching - 1;
                        let run = &group.runs[component];
                        let edges = &group.edges[component];
                        match in_view.of(component) {
                            Shares::None => {}
                            Shares::Whole => densities += run.at(self.kernel, edges, x, y),
                            Shares::Some(of) => {
                                densities += run.at(self.kernel, edges, x, y) * lanes(simd, &of)
                            }
                        }
                    }
                }
                densities = densities / (densities * self.temper + 1.0);
                for density in densities.iter().take(used) {
                    *total += density;
                }
            }
        }
    }
}

/// The places from which the states of a run see, of a trajectory with these positions.
#[inline(always)]
fn places(view: &mut Option<&mut View<'_>>, run: Range<usize>, x: &[f64], y: &[f64]) -> [usize; LANES] {
    let mut places = [0; LANES];
    let Some(view) = view else { return places };
    let mut before = usize::MAX;
    let mut place = 0;
    for (lane, of_lane) in places.iter_mut().enumerate() {
        let step = (run.start + lane).min(run.end - 1);
        let middle = view.middle(step);
        if middle != before {
            before = middle;
            place = view.place(step, x, y);
        }
        *of_lane = place;
    }
    places
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::convex_hull::distance_squared;

    impl State {
        /// The component's value at `p`, 1/m2.
        pub(in crate::evaluation) fn density(&self, kernel: Kernel, p: Point2) -> f64 {
            let dx = p.x - self.mean.x;
            let dy = p.y - self.mean.y;
            let squared =
                if self.hull.is_empty() { dx * dx + dy * dy } else { distance_squared(&self.hull, p) };
            let exponential =
                |x: f64| dispatch!(Level::baseline(), simd => exp_minus_8_to_0(f64x8::splat(simd, x))[0]);
            let exponent = self.exponent * squared;
            let exponent = if kernel == Kernel::Flat { -exponent * exponent } else { exponent };
            if squared <= self.cut { self.peak * exponential(exponent) } else { 0.0 }
        }
    }
}
