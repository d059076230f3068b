//! How far from the goal a candidate stays: `sum_k D(q_k, g)` of eq. 6.

use std::sync::Arc;

use crate::candidates::CandidateSet;
use crate::evaluation::{Costs, Evaluator, each};
use crate::geometry::Point2;
use crate::occupancy::GeodesicField;
use crate::scene::Scene;

/// What a state costs from which the goal cannot be reached, metres: more than any way through a map of
/// the largest size allowed, so that one such state outweighs every state that has a way.
pub const UNREACHABLE: f64 = 100_000.0;

crate::parameters! {
    /// Which distance `D` is (A11).
    #[derive(Default)]
    #[non_exhaustive]
    pub enum DistanceMeasure {
        /// The shortest way around obstacles: no dead ends.
        #[default]
        Geodesic,
        /// As the crow flies.
        Euclid,
    }
}

/// Term `distance`: distance to the goal summed over the states, metres.
#[derive(Debug, Clone)]
pub enum DistanceEvaluator {
    /// The geodesic distance to the goal of the field.
    Geodesic(Arc<GeodesicField>),
    /// The straight distance to the goal, which needs no map.
    Euclid(Point2),
}

impl DistanceEvaluator {
    /// Distance to go from one point, metres, at most [`UNREACHABLE`].
    #[inline]
    fn at(&self, p: Point2) -> f64 {
        let distance = match self {
            Self::Geodesic(field) => field.at(p),
            Self::Euclid(goal) => p.distance(*goal),
        };
        if distance < UNREACHABLE { distance } else { UNREACHABLE }
    }
}

impl Evaluator for DistanceEvaluator {
    fn evaluate(&self, _: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        each(candidates, should_stop, |i| {
            let states = candidates.range(i);
            let (x, y) = (&candidates.all_states().x[states.clone()], &candidates.all_states().y[states]);
            x.iter().zip(y).map(|(&x, &y)| self.at(Point2::new(x, y))).sum()
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::evaluation::Stopped;
    use crate::geometry::{Pose2, Twist};
    use crate::occupancy::{OccupancyGrid, StaticMap};
    use crate::scene::{Belief, People};
    use crate::states::States;

    fn scene() -> Scene {
        let belief = Belief {
            pose: Pose2::default(),
            covariance: nalgebra::Matrix3::zeros(),
            twist: Twist::default(),
        };
        Scene { tick: 0, stamp: 0.0, belief, people: People::default(), uncertain: false }
    }

    fn points(of: &[[(f64, f64); 2]]) -> CandidateSet {
        let flat: Vec<(f64, f64)> = of.iter().flatten().copied().collect();
        let mut states = States::default();
        flat.iter().for_each(|&(x, y)| states.push(Pose2::new(x, y, 0.0), Twist::default()));
        CandidateSet::new(2, 0.3, (0..of.len() as u32).collect(), states).unwrap()
    }

    /// 10 m x 10 m with a wall at x = 5 from y = 0 to y = 8; goal at (2, 2).
    fn walled() -> DistanceEvaluator {
        let cells = (0..10_000).map(|i| if i % 100 == 50 && i / 100 < 80 { 100 } else { 0 }).collect();
        let grid = OccupancyGrid::new(100, 100, 0.1, Pose2::default(), cells).unwrap();
        let field = GeodesicField::new(&StaticMap::new(grid), Point2::new(2.0, 2.0), 0.3);
        DistanceEvaluator::Geodesic(Arc::new(field))
    }

    #[test]
    fn a_way_around_counts_not_the_air_line() {
        let set = points(&[[(8.0, 2.0), (8.0, 2.0)], [(2.0, 8.0), (2.0, 8.0)]]);
        let geodesic = walled().evaluate(&scene(), &set, &|| false).unwrap();
        let euclid =
            DistanceEvaluator::Euclid(Point2::new(2.0, 2.0)).evaluate(&scene(), &set, &|| false).unwrap();
        // both 6 m off in the air; one is behind the wall
        assert!((euclid[0] - 12.0).abs() < 1e-12 && (euclid[1] - 12.0).abs() < 1e-12);
        assert!(geodesic[0] > 24.0, "{geodesic:?}");
        assert!((geodesic[1] - 12.0).abs() < 0.4, "{geodesic:?}");
    }

    #[test]
    fn costs_are_finite_where_there_is_no_way() {
        let set = points(&[[(-50.0, 2.0), (8.0, 2.0)]]);
        let cost = walled().evaluate(&scene(), &set, &|| false).unwrap()[0];
        assert!(cost > UNREACHABLE && cost < 2.0 * UNREACHABLE);
    }

    #[test]
    fn sharding_changes_no_cost() {
        let set = points(&[[(8.0, 2.0), (7.9, 2.1)], [(2.0, 8.0), (2.0, 7.7)], [(1.0, 1.0), (1.3, 1.3)]]);
        let whole = walled().evaluate(&scene(), &set, &|| false).unwrap();
        for (i, cost) in whole.iter().enumerate() {
            let alone = walled().evaluate(&scene(), &set.pick([i]), &|| false).unwrap();
            assert_eq!(alone[0].to_bits(), cost.to_bits());
        }
    }

    #[test]
    fn a_spent_budget_stops_it() {
        let set = points(&[[(8.0, 2.0), (8.0, 2.0)]]);
        assert_eq!(walled().evaluate(&scene(), &set, &|| true), Err(Stopped));
    }
}
