//! The choice of Risk-RRT as a term: the best node on a candidate, by the weight of the authors' code.

use std::sync::Arc;

use crate::candidates::CandidateSet;
use crate::collision_risk::{CollisionRisk, RiskParams};
use crate::evaluation::{Costs, Evaluator, each};
use crate::forecast::ForecastParams;
use crate::geometry::Point2;
use crate::lanes::{LANES, Level, Simd, SimdBase, dispatch, f64x8};
use crate::occupancy::StaticMap;
use crate::scene::Scene;

/// Term `risk`: the least `social_weight * risk + d` among a candidate's states, the reciprocal of
/// Risk-RRT's node weight, without unit.
///
/// Risk-RRT takes the path to the node of greatest weight, whether or not the tree goes on behind it. A
/// candidate passes through its nodes, so it is worth as much as the best of them, and the candidate of
/// least cost is the path that Risk-RRT takes. A state's risk is `P_s + (1 - P_s) P_d`, P_s being one
/// where the robot touches a wall, and never below that of the states before it.
#[derive(Debug, Clone)]
pub struct RiskEvaluator {
    /// Where walls are.
    pub map: Arc<StaticMap>,
    /// Where to go.
    pub goal: Point2,
    /// The robot's, metres.
    pub radius: f64,
    /// How people move on.
    pub forecast: ForecastParams,
    /// How risk is weighed.
    pub params: RiskParams,
}

impl RiskEvaluator {
    /// The costs, with vectors of this kind, which makes no difference to them.
    pub(super) fn evaluate_at(
        &self,
        level: Level,
        scene: &Scene,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
    ) -> Costs {
        let moments = (0..candidates.steps()).map(|k| (k + 1) as f64 * candidates.dt());
        let people = &scene.people;
        let params = &self.params;
        let risk = CollisionRisk::with(level, people, self.forecast, self.radius, params, moments);
        let root_distance = scene.belief.pose.position().distance(self.goal);
        let states = candidates.all_states();
        each(candidates, should_stop, |i| {
            let range = candidates.range(i);
            let [x, y, heading] = [&states.x, &states.y, &states.heading].map(|of| &of[range.clone()]);
            dispatch!(level, simd => self.cost(simd, &risk, root_distance, [x, y, heading]))
        })
    }

    /// The cost of one candidate, from its states' positions and headings.
    #[inline(always)]
    fn cost<S: Simd>(
        &self,
        simd: S,
        risk: &CollisionRisk,
        root_distance: f64,
        [x, y, heading]: [&[f64]; 3],
    ) -> f64 {
        let (mut worst, mut best): (f64, f64) = (0.0, f64::INFINITY);
        for first in (0..x.len()).step_by(LANES) {
            let used = LANES.min(x.len() - first);
            let mut risks = [0.0; LANES];
            for (lane, so_far) in risks[..used].iter_mut().enumerate() {
                let moment = first + lane;
                let p = Point2::new(x[first + lane], y[first + lane]);
                let clearance = self.map.to_obstacle.clearance(&self.map.grid, p, self.radius);
                let here = if clearance < self.radius { 1.0 } else { risk.at_with(simd, moment, p) };
                worst = worst.max(here);
                *so_far = worst;
            }
            let eight = |of: &[f64]| f64x8::from_fn(simd, |lane| of[first + lane.min(used - 1)]);
            let pose = [eight(x), eight(y), eight(heading)];
            let risks = f64x8::load_array(simd, risks);
            let costs = self.params.node_costs(pose, risks, root_distance, self.goal);
            best = costs.as_slice()[..used].iter().fold(best, |best, cost| best.min(*cost));
        }
        best
    }
}

impl Evaluator for RiskEvaluator {
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        self.evaluate_at(Level::new(), scene, candidates, should_stop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::Stopped;
    use crate::geometry::{Pose2, Twist};
    use crate::occupancy::OccupancyGrid;
    use crate::scene::{Belief, People};
    use crate::states::States;

    fn scene(people: People) -> Scene {
        let belief = Belief {
            pose: Pose2::new(2.0, 5.0, 0.0),
            covariance: nalgebra::Matrix3::zeros(),
            twist: Twist::default(),
        };
        Scene::new(belief, people)
    }

    fn person(x: f64, y: f64) -> People {
        People::walking(0.25, &[[x, y, 0.0, 0.0]])
    }

    /// 10 m x 10 m, walled at x >= 8; goal at (7, 5).
    fn evaluator() -> RiskEvaluator {
        let cells = (0..10_000).map(|i| if i % 100 >= 80 { 100 } else { 0 }).collect();
        let map = StaticMap::new(OccupancyGrid::new(100, 100, 0.1, Pose2::default(), cells).unwrap());
        let forecast = ForecastParams::default();
        let params = RiskParams::default();
        RiskEvaluator { map: Arc::new(map), goal: Point2::new(7.0, 5.0), radius: 0.3, forecast, params }
    }

    /// Straight ways of `steps` states, 0.3 m each, headed along x from (2, y).
    fn ways(steps: usize, ys: &[f64]) -> CandidateSet {
        let mut states = States::default();
        for &y in ys {
            (1..=steps).for_each(|k| states.push(Pose2::new(2.0 + 0.3 * k as f64, y, 0.0), Twist::default()));
        }
        CandidateSet::new(steps, 0.3, (0..ys.len() as u32).collect(), states).unwrap()
    }

    fn costs(people: People, set: &CandidateSet) -> Vec<f64> {
        evaluator().evaluate(&scene(people), set, &|| false).unwrap()
    }

    #[test]
    fn the_way_that_gets_nearer_costs_less_until_it_leads_into_a_person() {
        let ahead = costs(People::default(), &ways(10, &[5.0, 7.0]));
        assert!(ahead[0] < ahead[1], "{ahead:?}");
        let blocked = costs(person(2.4, 5.0), &ways(10, &[5.0, 7.0]));
        assert!(blocked[0] > ahead[0] + 0.2 && blocked[1] >= ahead[1], "{blocked:?}");
        assert!(blocked[0] - ahead[0] > blocked[1] - ahead[1] + 0.2, "{blocked:?}");
    }

    #[test]
    fn a_candidate_costs_what_its_states_say_one_by_one_bit_for_bit() {
        let evaluator = evaluator();
        let people = person(3.5, 5.2);
        for steps in [1, 7, 8, 9, 25] {
            let set = ways(steps, &[5.0, 5.3, 7.0]);
            let moments = (1..=steps).map(|k| k as f64 * 0.3);
            let risk = CollisionRisk::new(&people, evaluator.forecast, 0.3, &evaluator.params, moments);
            let expected = |i: usize| {
                let (mut worst, mut best): (f64, f64) = (0.0, f64::INFINITY);
                for (moment, pose) in set.range(i).map(|k| set.all_states().pose(k)).enumerate() {
                    let wall = evaluator.map.to_obstacle.clearance(&evaluator.map.grid, pose.position(), 0.3);
                    worst = worst.max(if wall < 0.3 { 1.0 } else { risk.at(moment, pose.position()) });
                    best = best.min(evaluator.params.node_cost(pose, worst, 5.0, evaluator.goal));
                }
                best.to_bits()
            };
            let found = costs(people.clone(), &set);
            assert_eq!(
                found.iter().map(|c| c.to_bits()).collect::<Vec<_>>(),
                (0..3).map(expected).collect::<Vec<_>>()
            );
        }
    }

    #[test]
    fn a_way_is_worth_its_best_node_however_it_goes_on() {
        // 20 states lead through the goal at 5 m and into the wall at 8 m.
        let short = costs(People::default(), &ways(16, &[5.0]));
        let long = costs(People::default(), &ways(25, &[5.0]));
        assert_eq!(short, long);
    }

    #[test]
    fn a_farther_pedestrian_never_costs_more() {
        let set = ways(10, &[5.0]);
        let at = |d: f64| costs(person(3.5, 5.0 + d), &set)[0];
        for k in 0..30 {
            let d = 0.1 * f64::from(k);
            assert!(at(d + 0.1) <= at(d) + 1e-12);
        }
    }

    #[test]
    fn sharding_changes_no_cost() {
        let set = ways(10, &[5.0, 5.5, 7.0]);
        let whole = costs(person(3.5, 5.0), &set);
        for (i, cost) in whole.iter().enumerate() {
            assert_eq!(costs(person(3.5, 5.0), &set.pick([i]))[0].to_bits(), cost.to_bits());
        }
    }

    #[test]
    fn a_spent_budget_stops_it() {
        let set = ways(10, &[5.0]);
        assert_eq!(evaluator().evaluate(&scene(People::default()), &set, &|| true), Err(Stopped));
    }
}
