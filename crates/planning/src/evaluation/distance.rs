//! How far from the goal a candidate stays: `sum_k D(q_k, g)` of eq. 6.

use std::sync::Arc;

use crate::candidates::CandidateSet;
use crate::evaluation::{Costs, Evaluator, Stopped};
use crate::geometry::Point2;
use crate::lanes::{LANES, Level, Simd, SimdBase, SimdFloat, dispatch, f64x8, lesser};
use crate::occupancy::GeodesicField;
use crate::scene::Scene;
use crate::states::States;

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

/// States between two looks at the budget, whole groups of lanes.
const STATES: usize = 32 * LANES;

impl DistanceEvaluator {
    /// The costs, with vectors of this kind, which makes no difference to them.
    pub(super) fn evaluate_at(
        &self,
        level: Level,
        candidates: &CandidateSet,
        should_stop: &dyn Fn() -> bool,
    ) -> Costs {
        let States { x, y, .. } = candidates.all_states();
        let mut metres = vec![0.0; x.len()];
        for ((metres, x), y) in metres.chunks_mut(STATES).zip(x.chunks(STATES)).zip(y.chunks(STATES)) {
            if should_stop() {
                return Err(Stopped);
            }
            match self {
                Self::Geodesic(field) => {
                    dispatch!(level, simd => fill(simd, metres, x, y, #[inline(always)] |x, y| field.at_each(x, y)));
                }
                Self::Euclid(goal) => {
                    dispatch!(level, simd => fill(simd, metres, x, y, #[inline(always)] |x, y| {
                        let dx = goal.x - x;
                        let dy = goal.y - y;
                        (dx * dx + dy * dy).sqrt()
                    }));
                }
            }
        }
        Ok(metres.chunks_exact(candidates.steps()).map(|metres| metres.iter().sum()).collect())
    }
}

/// Sets `metres` to the distance to go `at` each point, at most [`UNREACHABLE`].
#[inline(always)]
fn fill<S: Simd>(
    simd: S,
    metres: &mut [f64],
    x: &[f64],
    y: &[f64],
    at: impl Fn(f64x8<S>, f64x8<S>) -> f64x8<S>,
) {
    for (first, metres) in (0..).step_by(LANES).zip(metres.chunks_mut(LANES)) {
        // The last lanes are filled up with the last point.
        let last = first + metres.len() - 1;
        let lanes = |of: &[f64]| match of[first..].first_chunk() {
            Some(whole) => f64x8::load_array_ref(simd, whole),
            None => f64x8::from_fn(simd, |lane| of[(first + lane).min(last)]),
        };
        let distance = lesser(at(lanes(x), lanes(y)), f64x8::splat(simd, UNREACHABLE));
        metres.copy_from_slice(&distance.as_slice()[..metres.len()]);
    }
}

impl Evaluator for DistanceEvaluator {
    fn evaluate(&self, _: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        self.evaluate_at(Level::new(), candidates, should_stop)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Pose2, Twist};
    use crate::occupancy::{OccupancyGrid, StaticMap};
    use crate::scene::{Belief, People};

    fn scene() -> Scene {
        let belief = Belief {
            pose: Pose2::default(),
            covariance: nalgebra::Matrix3::zeros(),
            twist: Twist::default(),
        };
        Scene::new(belief, People::default())
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
