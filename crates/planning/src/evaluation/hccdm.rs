//! Curiosity for negative content: the human comfort and crowd density map (section IV-C, eqs. 16-18).
//!
//! Every individual and every crowd is one component, a Gaussian in the paper; the cost of a candidate is the density
//! of all components summed over its states. Where we differ from the printed equations: a component moves
//! with its people and widens with their forecast (D2), a crowd weighs as many as it has members (D1),
//! and a component ends at [`CUT_SIGMAS`]. If walls hide people, a component weighs at each state as many as it has
//! members in view of it.
//!
//! With [`GroupShape::Hull`] a crowd is as dense anywhere in the convex hull of its people, where they are expected at
//! the time of the state, and falls off around it as a lone person's component does. It holds its people spread evenly,
//! but is nowhere less dense than a lone one of them would be.

use crate::candidates::CandidateSet;
use crate::convex_hull::{area, convex_hull, perimeter};
use crate::crowd_cluster::{GroupParams, GroupShape, crowd_clusters};
use crate::evaluation::enclosing_circle::smallest_enclosing_circle;
use crate::evaluation::hccdm_simd::{Lanes, State};
use crate::evaluation::{Costs, Evaluator, Stopped, temper};
use crate::forecast::ForecastParams;
use crate::geometry::Point2;
use crate::lanes::Level;
use crate::numerics::hypot;
use crate::scene::{People, Scene};
use crate::sight::{Sight, View};

pub use crate::evaluation::hccdm_simd::{CUT_SIGMAS, Kernel};

crate::parameters! {
    /// How the sigma_g of eq. 17, in metres, enters the covariance of eq. 16 (A15).
    #[derive(Default)]
    #[non_exhaustive]
    pub enum Covariance {
        /// As printed: the number is the variance, Sigma_g = sigma_g I.
        #[default]
        Literal,
        /// By its dimension: the number is the standard deviation, Sigma_g = sigma_g^2 I.
        Squared,
    }
}

crate::parameters! {
    /// The weight p_g of a component of eps_g people (eq. 18, A14).
    #[derive(Default)]
    #[non_exhaustive]
    pub enum Weighting {
        /// p_g = eps_g: the map is smoothed people per square metre, however many others are around (D1).
        #[default]
        People,
        /// p_g = eps_g / sum of eps: the map is a probability density over the plane.
        Share,
    }
}

crate::parameters! {
    /// Where a component is at the time of a candidate's state (A19).
    #[derive(Default)]
    #[non_exhaustive]
    pub enum ComponentMotion {
        /// It moves with the mean velocity of its people and widens by the forecast's variance (D2).
        #[default]
        Moving,
        /// It stays where its people are now, as in the paper.
        Frozen,
    }
}

crate::parameters! {
    /// Parameters of the map.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct HccdmParams {
        /// D_pd of eq. 17, metres, positive: the comfortable distance of the paper's reference 17 (A16).
        pub personal_distance: f64 [
            0.01, 10.0, "m", "the spread of a lone person's zone follows from it and must not vanish;
            Hall's public space begins nearer"
        ] = 1.5,
        /// What sigma_g means.
        pub covariance: Covariance [words] = Covariance::Literal,
        /// How a component falls off.
        pub kernel: Kernel [words] = Kernel::Gaussian,
        /// What p_g is.
        pub weighting: Weighting [words] = Weighting::People,
        /// Whether components move.
        pub motion: ComponentMotion [words] = ComponentMotion::Moving,
        /// Density at which people stop to matter as many, 1/m2: h counts as h / (1 + h / saturation). In a dense crowd
        /// no place is comfortable, and only what differs matters. At 0 each person counts as much as the first, as in
        /// the paper.
        pub saturation: f64 [0.0, 1000.0, "1/m2", "no crowd is that dense"] = 0.0,
        /// How moving components widen.
        pub forecast: ForecastParams [table] = ForecastParams::default(),
    }
}

/// One component of the mixture as it is now.
#[derive(Debug, Clone, PartialEq)]
pub struct Component {
    /// Mean mu_g of eq. 17: the person, or the centre of the smallest circle around the crowd; map frame.
    pub centre: Point2,
    /// Diagonal of Sigma_g of eq. 16, m2, wider by what is not known of the members' positions. Of a hull, that of what
    /// is around it.
    pub variance: f64,
    /// p_g of eq. 18.
    pub weight: f64,
    /// Mean velocity of the members, m/s.
    pub velocity: Point2,
    /// Variance of the members' velocities, the mean of both axes, m2/s2: people who walk apart spread the component,
    /// and so does what is not known of their velocities. A hull spreads by itself.
    pub velocity_variance: f64,
    /// Identities of the people in it, ascending.
    pub members: Vec<u32>,
    /// Each of a crowd that takes the room of its hull; none otherwise.
    each: Vec<Member>,
}

/// One of a crowd that takes the room of its hull.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Member {
    /// Map frame.
    position: Point2,
    /// m/s.
    velocity: Point2,
    /// Diagonal of its Sigma_g if it were alone, m2.
    variance: f64,
    /// What is not known of its velocity, m2/s2.
    velocity_variance: f64,
}

impl Component {
    fn new(people: &People, cluster: &[usize], params: &HccdmParams, groups: &GroupParams) -> Self {
        let is_hull = groups.shape == GroupShape::Hull && cluster.len() > 1;
        let positions: Vec<Point2> = cluster.iter().map(|&i| people.position(i)).collect();
        let (centre, radius) =
            smallest_enclosing_circle(&positions).map_or_else(Default::default, |c| (c.centre, c.radius));
        let sigma = if is_hull { params.personal_distance } else { radius + params.personal_distance };
        let mean =
            |of: &dyn Fn(usize) -> f64| cluster.iter().map(|&i| of(i)).sum::<f64>() / cluster.len() as f64;
        let velocity = Point2::new(mean(&|i| people.vx[i]), mean(&|i| people.vy[i]));
        let off = |i: usize| {
            if is_hull { 0.0 } else { Point2::new(people.vx[i], people.vy[i]).distance_squared(velocity) }
        };
        let known_exactly = match params.covariance {
            Covariance::Literal => sigma,
            Covariance::Squared => sigma * sigma,
        };
        Self {
            centre,
            variance: known_exactly + mean(&|i| people.variances(i).0),
            weight: match params.weighting {
                Weighting::People => cluster.len() as f64,
                Weighting::Share => cluster.len() as f64 / people.len() as f64,
            },
            velocity,
            velocity_variance: 0.5 * mean(&off) + mean(&|i| people.variances(i).1),
            members: cluster.iter().map(|&i| people.id[i]).collect(),
            each: cluster
                .iter()
                .filter(|_| is_hull)
                .map(|&i| Member::new(people, i, known_exactly))
                .collect(),
        }
    }

    /// Where and how wide it is after `t` seconds.
    fn state(&self, params: &HccdmParams, t: f64) -> State {
        let t = match params.motion {
            ComponentMotion::Moving => t,
            ComponentMotion::Frozen => 0.0,
        };
        let variance = self.variance + (params.spread(self.velocity, t) + self.velocity_variance * t * t);
        if self.each.is_empty() {
            let c = self.centre;
            let v = self.velocity;
            let centre = Point2::new(c.x + v.x * t, c.y + v.y * t);
            return State::new(params.kernel, centre, variance, self.weight);
        }
        let expected: Vec<Point2> = self.each.iter().map(|member| member.after(t)).collect();
        let hull = convex_hull(&expected);
        // Steiner's formula: what a hull and the even strip around it hold.
        let held = params.kernel.held(variance, area(&hull), perimeter(&hull));
        let share = self.weight / self.each.len() as f64;
        let peaks = self.each.iter().map(|member| share * member.peak(params, t));
        let peak = peaks.fold(self.weight / held, f64::max);
        State::of_hull(params.kernel, hull, variance, peak)
    }
}

impl HccdmParams {
    /// Variance by which the forecast widens what moves with this velocity, after `t` seconds, m2.
    fn spread(&self, velocity: Point2, t: f64) -> f64 {
        match self.motion {
            ComponentMotion::Moving => self.forecast.variance_at(hypot(velocity.x, velocity.y), t),
            ComponentMotion::Frozen => 0.0,
        }
    }
}

impl Member {
    /// The i-th person, whose Sigma_g is `known_exactly` if the position is, m2.
    fn new(people: &People, i: usize, known_exactly: f64) -> Self {
        let (position, velocity) = people.variances(i);
        Self {
            position: people.position(i),
            velocity: Point2::new(people.vx[i], people.vy[i]),
            variance: known_exactly + position,
            velocity_variance: velocity,
        }
    }

    /// The density at its mean if it were alone, after `t` seconds, 1/m2.
    fn peak(&self, params: &HccdmParams, t: f64) -> f64 {
        let spread = params.spread(self.velocity, t) + self.velocity_variance * t * t;
        1.0 / params.kernel.held(self.variance + spread, 0.0, 0.0)
    }

    /// Where it is expected after `t` seconds.
    fn after(&self, t: f64) -> Point2 {
        Point2::new(self.position.x + self.velocity.x * t, self.position.y + self.velocity.y * t)
    }
}

/// The map of one scene, ready to score candidates of `steps` states `dt` seconds apart.
#[derive(Debug, Clone)]
pub struct Hccdm {
    components: Vec<Component>,
    /// The people of each, as indices.
    clusters: Vec<Vec<usize>>,
    lanes: Lanes,
}

impl Hccdm {
    /// Clusters the people, fits a component to each cluster and lays out its states over the horizon.
    /// Components are in the order of their first member in `people`. With `sight`, no wall parts the people of one.
    pub fn build(
        people: &People,
        params: &HccdmParams,
        groups: &GroupParams,
        sight: Option<&Sight>,
        steps: usize,
        dt: f64,
    ) -> Self {
        let clusters = crowd_clusters(people, groups, sight);
        let components: Vec<Component> =
            clusters.iter().map(|cluster| Component::new(people, cluster, params, groups)).collect();
        let shape = (params.kernel, temper(params.saturation));
        let lanes =
            Lanes::new(steps, shape, components.len(), |g, k| components[g].state(params, time_of(k, dt)));
        Self { components, clusters, lanes }
    }

    /// The components, as they are now.
    pub fn components(&self) -> &[Component] {
        &self.components
    }

    /// H of eq. 18 of one trajectory: the density of all people summed over its states, 1/m2. `x` and `y` hold exactly
    /// `steps` numbers.
    pub fn cost(&self, x: &[f64], y: &[f64]) -> f64 {
        self.lanes.sums(Level::new(), x, y, None)[0]
    }
}

/// Seconds from the scene to state `k` of a candidate.
fn time_of(k: usize, dt: f64) -> f64 {
    (k + 1) as f64 * dt
}

/// Term `cnc`: H of eq. 18 over the scene's people.
#[derive(Debug, Clone)]
pub struct HccdmEvaluator {
    /// Such as [`HccdmParams::check`](crate::parameters::Ranged::check) passes.
    pub params: HccdmParams,
    /// Who belongs together.
    pub groups: GroupParams,
    /// What hides people; nothing does if there is none.
    pub sight: Option<Sight>,
}

/// Candidates between two looks at the budget.
const GROUP: usize = 16;

impl HccdmEvaluator {
    /// The costs, with vectors of this kind, which makes no difference to them.
    pub(crate) fn evaluate_at(
        &self,
        level: Level,
        scene: &Scene,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
    ) -> Costs {
        let steps = candidates.steps();
        let dt = candidates.dt();
        let sight = self.sight.as_ref();
        let map = Hccdm::build(&scene.people, &self.params, &self.groups, sight, steps, dt);
        let mut view = sight.map(|sight| View::new(sight, scene, &map.clusters, steps, dt));
        let mut costs = Vec::with_capacity(candidates.len());
        let states = candidates.all_states();
        let numbers = GROUP * steps;
        for (x, y) in states.x.chunks(numbers).zip(states.y.chunks(numbers)) {
            if should_stop() {
                return Err(Stopped);
            }
            if let Some(view) = &mut view {
                view.trim();
            }
            costs.append(&mut map.lanes.sums(level, x, y, view.as_mut()));
        }
        Ok(costs)
    }
}

impl Evaluator for HccdmEvaluator {
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        self.evaluate_at(Level::new(), scene, candidates, should_stop)
    }
}

#[cfg(test)]
#[path = "hccdm_tests.rs"]
mod tests;
