//! How likely the robot touches a person at a place and a moment: the risk of Risk-RRT (Fulgenzi,
//! Spalanzani, Laugier and Tay, 2010).
//!
//! Where [`crate::collision`] says yes or no for the final check of every planner, this is the graded
//! answer by which the Risk-RRT baselines choose.

use std::sync::Arc;

use crate::forecast::ForecastParams;
use crate::geometry::{Point2, Pose2, bearing, wrap_angle};
use crate::lanes::*;
use crate::scene::People;
use overlap::OverlapTable;

mod overlap;

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
        /// What the term `collision-risk` counts a contact in which the robot stands, as a share of one at its greatest
        /// speed. At 1 its speed does not matter.
        pub standing_share: f64 [0.0, 1.0, "", "a share"] = 1.0,
        /// Whether the term `collision-risk` counts how well the robot will know its position.
        pub belief: bool = false,
    }
}

impl RiskParams {
    /// The reciprocal of a node's weight, `social_weight * risk + d`: lower is better. `d` is the
    /// distance to `target` as a share of the root's, `root_distance` metres, plus the turn towards it.
    pub fn node_cost(&self, pose: Pose2, risk: f64, root_distance: f64, target: Point2) -> f64 {
        let turn = wrap_angle(bearing(pose.position(), target) - pose.heading).abs();
        let far = self.social_weight * risk + pose.position().distance(target) / unit(root_distance);
        far + self.rotation_weight * turn
    }

    /// The same of eight nodes.
    #[inline(always)]
    pub(crate) fn node_costs<S: Simd>(
        &self,
        [x, y, heading]: [f64x8<S>; 3],
        risk: f64x8<S>,
        root_distance: f64,
        target: Point2,
    ) -> f64x8<S> {
        let dx = target.x - x;
        let dy = target.y - y;
        let far = risk * self.social_weight + (dx * dx + dy * dy).sqrt() / unit(root_distance);
        far + library::wrap_angle(library::atan2(dy, dx) - heading).abs() * self.rotation_weight
    }
}

/// What a distance of one is in a node's cost, metres.
pub(crate) fn unit(root_distance: f64) -> f64 {
    root_distance.max(LEAST_DISTANCE)
}

/// Distances are compared with at least this one, metres, so that the goal itself has a finite cost.
const LEAST_DISTANCE: f64 = 0.01;

/// The chances to touch people who may be far or near, computed for eight near ones at a time.
#[derive(Debug)]
pub(crate) struct Contacts {
    /// Metres at which robot and person touch.
    contact: f64,
    /// The greatest chance of each person so far.
    worst: Vec<f64>,
    /// Those who wait: how many, distances and standard deviations of their forecasts, metres, and who they are.
    waiting: usize,
    distances: [f64; LANES],
    sigmas: [f64; LANES],
    /// What their chances count.
    shares: [f64; LANES],
    who: [usize; LANES],
}

impl Contacts {
    /// Nothing yet, of so many people.
    pub(crate) fn new(contact: f64, people: usize) -> Self {
        let distances = [0.0; LANES];
        let sigmas = [1.0; LANES];
        let shares = [1.0; LANES];
        Self { contact, worst: vec![0.0; people], waiting: 0, distances, sigmas, shares, who: [0; LANES] }
    }

    /// Which of eight people the robot may touch at `p`, lowest bit first, and how far they are, metres. Their
    /// forecasts have these means and standard deviations. Beyond contact and four of these there is no chance.
    #[inline(always)]
    pub(crate) fn near<S: Simd>(
        &self,
        simd: S,
        p: Point2,
        means: &[[f64; LANES]; 2],
        sigmas: &[f64; LANES],
    ) -> (u64, [f64; LANES]) {
        let [x, y] = means.map(|of| f64x8::load_array(simd, of));
        let dx = p.x - x;
        let dy = p.y - y;
        let distances = (dx * dx + dy * dy).sqrt();
        let far = self.contact + overlap::CUT * f64x8::load_array_ref(simd, sigmas);
        (distances.simd_lt(far).to_bitmask(), distances.into())
    }

    /// Adds the chance that the robot touches those of eight people from `first` on who are `near`, as
    /// [`Self::near`] has found them.
    #[inline(always)]
    pub(crate) fn add<S: Simd>(
        &mut self,
        simd: S,
        mut near: u64,
        distances: [f64; LANES],
        first: usize,
        sigmas: &[f64; LANES],
        share: f64,
    ) {
        while near != 0 {
            let lane = near.trailing_zeros() as usize;
            near &= near - 1;
            let sigma = sigmas[lane];
            if sigma <= 0.0 {
                self.worst[first + lane] = share.max(self.worst[first + lane]);
                continue;
            }
            self.distances[self.waiting] = distances[lane];
            self.sigmas[self.waiting] = sigma;
            self.shares[self.waiting] = share;
            self.who[self.waiting] = first + lane;
            self.waiting += 1;
            if self.waiting == LANES {
                self.flush(simd);
            }
        }
    }

    #[inline(always)]
    fn flush<S: Simd>(&mut self, simd: S) {
        let found = overlap::disc_probability(simd, self.contact, self.distances, self.sigmas);
        for (j, chance) in found.into_iter().enumerate().take(self.waiting) {
            let who = self.who[j];
            self.worst[who] = (self.shares[j] * chance).max(self.worst[who]);
        }
        self.waiting = 0;
    }

    /// The chance to touch nobody, each person counted at the worst, and a new beginning.
    #[inline(always)]
    pub(crate) fn free<S: Simd>(&mut self, simd: S) -> f64 {
        if self.waiting > 0 {
            self.flush(simd);
        }
        let free = self.worst.iter().fold(1.0, |free, chance| free * (1.0 - chance));
        self.worst.fill(0.0);
        free
    }
}

/// Mean positions of all people after `t` seconds, eight by eight, x and y; at infinity beyond the last.
pub(crate) fn means_after(people: &People, t: f64) -> Vec<[[f64; LANES]; 2]> {
    let mean = |i: usize| {
        if i < people.len() { people.position_after(i, t) } else { Point2::new(f64::INFINITY, f64::INFINITY) }
    };
    let group = |first: usize| {
        let means: [Point2; LANES] = std::array::from_fn(|lane| mean(first + lane));
        [means.map(|p| p.x), means.map(|p| p.y)]
    };
    (0..people.len()).step_by(LANES).map(group).collect()
}

/// The probability of touching people at given moments, ready for many positions.
#[derive(Debug, Clone)]
pub struct CollisionRisk {
    level: Level,
    model: RiskModel,
    /// Half the side of robot and block together, metres.
    half_side: f64,
    moments: Vec<Moment>,
}

#[derive(Debug, Clone)]
struct Moment {
    /// Mean positions of eight people each, x and y; at infinity beyond the last person.
    means: Vec<[[f64; LANES]; 2]>,
    overlap: Arc<OverlapTable>,
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
        Self::with(Level::new(), people, forecast, radius, params, moments)
    }

    /// The same with vectors of this kind, which makes no difference to the result.
    pub(crate) fn with(
        level: Level,
        people: &People,
        forecast: ForecastParams,
        radius: f64,
        params: &RiskParams,
        moments: impl Iterator<Item = f64>,
    ) -> Self {
        let contact = radius + people.radius;
        let of_moment = |t: f64| {
            let t = t.max(0.0);
            let needed = params.model == RiskModel::Gaussian && !people.is_empty();
            Moment {
                means: means_after(people, t),
                overlap: if needed {
                    OverlapTable::of(level, contact, forecast.variance(t).sqrt())
                } else {
                    Arc::default()
                },
            }
        };
        let half_side = radius + params.block;
        Self { level, model: params.model, half_side, moments: moments.map(of_moment).collect() }
    }

    /// P_d, the probability of touching any person at `p` at moment number `moment`:
    /// `1 - prod_i (1 - P_d(o_i))`.
    pub fn at(&self, moment: usize, p: Point2) -> f64 {
        dispatch!(self.level, simd => self.at_with(simd, moment, p))
    }

    /// The same for callers that compute with lanes.
    #[inline(always)]
    pub(crate) fn at_with<S: Simd>(&self, simd: S, moment: usize, p: Point2) -> f64 {
        let Moment { means, overlap } = &self.moments[moment];
        let mut free = 1.0;
        for [x, y] in means {
            let dx = f64x8::load_array_ref(simd, x) - p.x;
            let dy = f64x8::load_array_ref(simd, y) - p.y;
            match self.model {
                RiskModel::Gaussian => free = overlap.times_free(free, dx * dx + dy * dy),
                RiskModel::Grid => {
                    let blocked = dx.abs().simd_le(self.half_side) & dy.abs().simd_le(self.half_side);
                    if blocked.any_true() {
                        return 1.0;
                    }
                }
            }
        }
        1.0 - free
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::tests::levels;
    use crate::random::{rng, uniform};

    fn walker(x: f64, vx: f64) -> People {
        People::walking(0.25, &[[x, 0.0, vx, 0.0]])
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
        let one = risk(&one, RiskModel::Gaussian);
        let two = risk(&two, RiskModel::Gaussian);
        let p = one.at(2, Point2::default());
        let q = two.at(2, Point2::default());
        assert!((q - (1.0 - (1.0 - p) * (1.0 - p))).abs() < 1e-12 && q > p && q < 2.0 * p);
    }

    #[test]
    fn contacts_have_the_bits_of_each_person_and_place_alone_with_every_kind_of_vectors() {
        let mut r = rng(6, 0);
        for _ in 0..50 {
            let rows: Vec<[f64; 4]> = (0..1 + (20.0 * uniform(&mut r)) as usize)
                .map(|_| [6.0 * uniform(&mut r), 6.0 * uniform(&mut r), uniform(&mut r), -uniform(&mut r)])
                .collect();
            let people = People::walking(0.25, &rows);
            let way: Vec<(f64, Point2, f64)> = (1..=9)
                .map(|k| {
                    let p = Point2::new(6.0 * uniform(&mut r), 6.0 * uniform(&mut r));
                    // The last is known without error.
                    (0.3 * f64::from(k), p, if k < 9 { 0.05 + 0.6 * uniform(&mut r) } else { 0.0 })
                })
                .collect();
            let chance = |distance: f64, sigma: f64| match sigma {
                _ if distance >= 0.55 + overlap::CUT * sigma => 0.0,
                0.0 => 1.0,
                _ => dispatch!(Level::baseline(), simd => {
                    overlap::disc_probability(simd, 0.55, [distance; LANES], [sigma; LANES])[0]
                }),
            };
            let worst = |i: usize| {
                let chances =
                    way.iter().map(|&(t, p, sigma)| chance(people.position_after(i, t).distance(p), sigma));
                chances.fold(0.0, f64::max)
            };
            let expected = (0..people.len()).fold(1.0, |free, i| free * (1.0 - worst(i)));
            for level in levels() {
                let mut contacts = Contacts::new(0.55, people.len());
                // The second time nothing of the first is left.
                for _ in 0..2 {
                    let found = dispatch!(level, simd => free(simd, &mut contacts, &people, &way));
                    assert_eq!(found.to_bits(), expected.to_bits());
                }
            }
        }
    }

    #[inline(always)]
    fn free<S: Simd>(simd: S, contacts: &mut Contacts, people: &People, way: &[(f64, Point2, f64)]) -> f64 {
        for &(t, p, sigma) in way {
            for (group, means) in means_after(people, t).iter().enumerate() {
                let (near, distances) = contacts.near(simd, p, means, &[sigma; LANES]);
                contacts.add(simd, near, distances, group * LANES, &[sigma; LANES], 1.0);
            }
        }
        contacts.free(simd)
    }

    #[test]
    fn many_people_side_by_side_are_as_likely_touched_as_one_after_the_other() {
        let seed = 6;
        let mut r = rng(seed, 0);
        for k in 0..300 {
            let model = if k % 2 == 0 { RiskModel::Gaussian } else { RiskModel::Grid };
            let mut place = |size: f64| size * (2.0 * uniform(&mut r) - 1.0);
            let mut people = People { radius: 0.25, ..People::default() };
            for id in 0..k % 21 {
                people.id.push(id);
                [&mut people.x, &mut people.y].into_iter().for_each(|of| of.push(place(3.0)));
                [&mut people.vx, &mut people.vy].into_iter().for_each(|of| of.push(place(1.0)));
            }
            let p = Point2::new(place(3.0), place(3.0));
            let moment = (k % 20) as usize;
            let alone = |i: usize| risk(&people.pick([i]), model).at(moment, p);
            let spared: f64 = (0..people.len()).map(|i| 1.0 - alone(i)).product();
            let found = risk(&people, model).at(moment, p);
            assert!((1.0 - spared - found).abs() < 1e-12, "seed {seed}, {k} people: {found} {spared}");
        }
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

    #[test]
    fn eight_nodes_cost_what_each_of_them_does_bit_for_bit() {
        let seed = 7;
        let mut r = rng(seed, 0);
        for k in 0..5000 {
            let mut eight = |size: f64| -> [f64; LANES] {
                std::array::from_fn(|_| match (8.0 * uniform(&mut r)) as u32 {
                    0 => 0.0,
                    _ => size * (2.0 * uniform(&mut r) - 1.0),
                })
            };
            let x = eight(5.0);
            let y = eight(5.0);
            let heading = eight(3.2);
            let risk = eight(1.0).map(f64::abs);
            let target = Point2::new(eight(5.0)[0], eight(5.0)[1]);
            let root_distance = eight(9.0)[0].abs();
            let params = RiskParams { rotation_weight: f64::from(k % 3), ..RiskParams::default() };
            for level in levels() {
                let found: [f64; LANES] = dispatch!(level, simd => {
                    let [x, y, heading, risk] = [x, y, heading, risk].map(|of| f64x8::load_array(simd, of));
                    params.node_costs([x, y, heading], risk, root_distance, target).into()
                });
                for lane in 0..LANES {
                    let pose = Pose2::new(x[lane], y[lane], heading[lane]);
                    let cost = params.node_cost(pose, risk[lane], root_distance, target);
                    assert_eq!(found[lane].to_bits(), cost.to_bits(), "seed {seed}, {level:?}, {pose:?}");
                }
            }
        }
    }
}
