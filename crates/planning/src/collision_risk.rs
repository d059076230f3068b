//! How likely the robot touches a person at a place and a moment: the risk of Risk-RRT (Fulgenzi,
//! Spalanzani, Laugier and Tay, 2010).
//!
//! Where [`crate::collision`] says yes or no for the final check of every planner, this is the graded
//! answer by which the Risk-RRT baselines choose.

use crate::forecast::ForecastParams;
use crate::geometry::{Point2, Pose2, bearing, wrap_angle};
use crate::numerics::{asin, erf, exp, sin_cos};
use crate::scene::People;

crate::parameters! {
    /// How a person's forecast becomes a probability.
    #[derive(Default)]
    #[non_exhaustive]
    pub enum RiskModel {
        /// The share of the person's Gaussian forecast under the robot's disc.
        #[default]
        Gaussian,
        /// Certainty inside a square block around the forecast's mean and nothing outside, as the authors'
        /// ROS package has it.
        Grid,
    }
}

crate::parameters! {
    /// Parameters of risk and of the weight that trades it for progress.
    #[derive(Copy)]
    #[non_exhaustive]
    pub struct RiskParams {
        /// How people's forecasts become probabilities.
        pub model: RiskModel [words] = RiskModel::Gaussian,
        /// Half the side of a person's block in the risk model `grid`, metres: five cells of 0.054 m.
        pub block: f64 [0.0, 10.0, "m", "a block wider than that is not a person"] = 0.27,
        /// What a risk of one costs in a node's weight; a goal as far as from the root costs one.
        pub social_weight: f64 [0.0, 1e6, "", "beyond, distance no longer counts beside risk"] = 1.0,
        /// What a radian between heading and goal costs in a node's weight, 1/rad.
        pub rotation_weight: f64 [0.0, 1e6, "1/rad", "beyond, distance no longer counts beside turning"] = 0.5,
    }
}

impl RiskParams {
    /// The reciprocal of a node's weight, `social_weight * risk + d`: lower is better. `d` is the
    /// distance to `target` as a share of the root's, `root_distance` metres, plus the turn towards it.
    pub fn node_cost(&self, pose: Pose2, risk: f64, root_distance: f64, target: Point2) -> f64 {
        self.far_cost(pose.position(), risk, root_distance, target) + self.turn_cost(pose, target)
    }

    /// [`Self::node_cost`] without the turn: never more than the whole.
    pub fn far_cost(&self, position: Point2, risk: f64, root_distance: f64, target: Point2) -> f64 {
        self.social_weight * risk + position.distance(target) / root_distance.max(LEAST_DISTANCE)
    }

    /// The turn's part of [`Self::node_cost`].
    pub fn turn_cost(&self, pose: Pose2, target: Point2) -> f64 {
        self.rotation_weight * wrap_angle(bearing(pose.position(), target) - pose.heading).abs()
    }
}

/// Distances are compared with at least this one, metres, so that the goal itself has a finite cost.
const LEAST_DISTANCE: f64 = 0.01;
/// Entries of a table over distance.
const ENTRIES: usize = 32;
/// Standard deviations beyond contact at which a person no longer counts.
const CUT: f64 = 4.0;

/// The probability of touching people at given moments, ready for many positions.
#[derive(Debug, Clone)]
pub struct CollisionRisk {
    model: RiskModel,
    /// Half the side of robot and block together, metres.
    half_side: f64,
    people: usize,
    /// Mean positions, `[moment, person]`.
    mean: Vec<Point2>,
    /// One table a moment.
    overlap: Vec<OverlapTable>,
}

impl CollisionRisk {
    /// The risk at each of `moments`, seconds from now, to a disc of `radius` metres.
    pub fn new(
        people: &People,
        forecast: ForecastParams,
        radius: f64,
        params: &RiskParams,
        moments: impl Iterator<Item = f64>,
    ) -> Self {
        let contact = radius + people.radius;
        let (mut mean, mut overlap) = (Vec::new(), Vec::new());
        for t in moments {
            let t = t.max(0.0);
            mean.extend((0..people.len()).map(|i| people.position_after(i, t)));
            let needed = params.model == RiskModel::Gaussian && !people.is_empty();
            overlap.push(if needed {
                OverlapTable::new(contact, forecast.variance(t).sqrt())
            } else {
                OverlapTable::default()
            });
        }
        let half_side = radius + params.block;
        Self { model: params.model, half_side, people: people.len(), mean, overlap }
    }

    /// P_d, the probability of touching any person at `p` at moment number `moment`:
    /// `1 - prod_i (1 - P_d(o_i))`.
    pub fn at(&self, moment: usize, p: Point2) -> f64 {
        let means = &self.mean[moment * self.people..(moment + 1) * self.people];
        match self.model {
            RiskModel::Gaussian => {
                let table = &self.overlap[moment];
                let free = means.iter().fold(1.0, |free, mean| {
                    let squared = mean.distance_squared(p);
                    if squared < table.reach_squared { free * (1.0 - table.at(squared.sqrt())) } else { free }
                });
                1.0 - free
            }
            RiskModel::Grid => {
                let blocked = |mean: &Point2| {
                    (mean.x - p.x).abs() <= self.half_side && (mean.y - p.y).abs() <= self.half_side
                };
                if means.iter().any(blocked) { 1.0 } else { 0.0 }
            }
        }
    }
}

/// Probability of contact by distance between the robot and the mean of a person's forecast.
#[derive(Debug, Clone, Default)]
struct OverlapTable {
    reach_squared: f64,
    per_metre: f64,
    probability: Vec<f64>,
}

impl OverlapTable {
    fn new(contact: f64, sigma: f64) -> Self {
        let reach = contact + CUT * sigma;
        let step = reach / ENTRIES as f64;
        // One entry more than is looked up, so that interpolation has a right neighbour.
        let probability =
            (0..=ENTRIES + 1).map(|k| disc_probability(contact, k as f64 * step, sigma)).collect();
        Self { reach_squared: reach * reach, per_metre: 1.0 / step, probability }
    }

    /// Linear between entries; `distance` below the reach.
    fn at(&self, distance: f64) -> f64 {
        let s = distance * self.per_metre;
        let k = (s as usize).min(ENTRIES);
        let (a, b) = (self.probability[k], self.probability[k + 1]);
        a + (s - k as f64) * (b - a)
    }
}

/// Share of an isotropic Gaussian of standard deviation `sigma` inside a disc of `radius` whose centre
/// is `distance` from its mean, all in metres.
///
/// Strips across the line of centres: the one at `x = radius sin u` has the closed form
/// `density(x) erf(radius cos u / (sigma sqrt 2))`; Simpson's rule in `u`, in which it is smooth.
fn disc_probability(radius: f64, distance: f64, sigma: f64) -> f64 {
    const INTERVALS: usize = 24;
    if sigma <= 0.0 {
        return if distance < radius { 1.0 } else { 0.0 };
    }
    let bound = |x: f64| (x / radius).clamp(-1.0, 1.0);
    let (low, high) = (asin(bound(distance - 6.0 * sigma)), asin(bound(distance + 6.0 * sigma)));
    let h = (high - low) / INTERVALS as f64;
    let sum = (0..=INTERVALS).fold(0.0, |sum, k| {
        let (s, c) = sin_cos(low + k as f64 * h);
        let z = (radius * s - distance) / sigma;
        let strip = exp(-0.5 * z * z) * erf(radius * c / (sigma * std::f64::consts::SQRT_2)) * radius * c;
        let weight = if k == 0 || k == INTERVALS { 1.0 } else { f64::from(2 + 2 * (k as u32 % 2)) };
        sum + weight * strip
    });
    (sum * h / 3.0 / (sigma * std::f64::consts::TAU.sqrt())).clamp(0.0, 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::{rng, standard_normal};

    fn walker(x: f64, vx: f64) -> People {
        People { id: vec![0], x: vec![x], y: vec![0.0], vx: vec![vx], vy: vec![0.0], radius: 0.25 }
    }

    fn risk(people: &People, model: RiskModel) -> CollisionRisk {
        let params = RiskParams { model, ..RiskParams::default() };
        CollisionRisk::new(
            people,
            ForecastParams::default(),
            0.3,
            &params,
            (0..20).map(|k| 0.3 * f64::from(k)),
        )
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
            let exact = disc_probability(0.55, distance, sigma);
            let table = OverlapTable::new(0.55, sigma).at(distance);
            let sampled = inside as f64 / f64::from(n);
            assert!((exact - sampled).abs() < 0.004, "{distance} {sigma}: {exact} {sampled}");
            assert!((exact - table).abs() < 0.003, "{distance} {sigma}: {exact} {table}");
        }
    }

    #[test]
    fn a_farther_person_is_never_a_greater_risk_and_no_person_is_none() {
        let people = walker(0.0, 0.0);
        for model in [RiskModel::Gaussian, RiskModel::Grid] {
            let risk = risk(&people, model);
            for moment in 0..20 {
                let along: Vec<f64> =
                    (0..100).map(|k| risk.at(moment, Point2::new(0.05 * f64::from(k), 0.0))).collect();
                assert!(along.windows(2).all(|w| w[1] <= w[0] + 1e-4));
                assert!(along.iter().all(|p| (0.0..=1.0).contains(p)));
            }
            assert_eq!(self::risk(&People::default(), model).at(3, Point2::default()), 0.0);
        }
    }

    #[test]
    fn risk_moves_with_the_person_and_spreads_with_time() {
        let people = walker(0.0, 1.0);
        let risk = risk(&people, RiskModel::Gaussian);
        // after 10 * 0.3 s the person is expected at x = 3
        assert!(risk.at(10, Point2::new(3.0, 0.0)) > risk.at(10, Point2::new(0.0, 0.0)));
        assert!(risk.at(0, Point2::new(0.0, 0.0)) > risk.at(10, Point2::new(3.0, 0.0)));
    }

    #[test]
    fn two_people_are_more_risk_than_either_and_less_than_both() {
        let one = walker(0.6, 0.0);
        let mut two = walker(0.6, 0.0);
        two.id.push(1);
        two.x.push(-0.6);
        two.y.push(0.0);
        two.vx.push(0.0);
        two.vy.push(0.0);
        let (one, two) = (risk(&one, RiskModel::Gaussian), risk(&two, RiskModel::Gaussian));
        let (p, q) = (one.at(2, Point2::default()), two.at(2, Point2::default()));
        assert!((q - (1.0 - (1.0 - p) * (1.0 - p))).abs() < 1e-12 && q > p && q < 2.0 * p);
    }

    #[test]
    fn a_node_costs_less_the_safer_nearer_and_straighter_it_is() {
        let params = RiskParams::default();
        let goal = Point2::new(10.0, 0.0);
        let at = |x, heading, risk| params.node_cost(Pose2::new(x, 0.0, heading), risk, 10.0, goal);
        assert!((at(0.0, 0.0, 0.0) - 1.0).abs() < 1e-12);
        assert!(at(1.0, 0.0, 0.0) < at(0.0, 0.0, 0.0));
        assert!(at(1.0, 0.3, 0.0) > at(1.0, 0.0, 0.0));
        assert!(at(1.0, 0.0, 0.5) > at(0.0, 0.0, 0.0));
        assert!(params.node_cost(Pose2::new(10.0, 0.0, 0.0), 0.0, 0.0, goal).is_finite());
    }
}
