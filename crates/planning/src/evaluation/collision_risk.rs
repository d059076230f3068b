//! The collision risk of the paper's references 6 and 15 as a term, inferred: how likely the robot touches a person on
//! its way.

use crate::candidates::CandidateSet;
use crate::collision_risk::{Contacts, means_after};
use crate::evaluation::cpc::CpcEvaluator;
use crate::evaluation::{Costs, Evaluator, Stopped};
use crate::forecast::ForecastParams;
use crate::geometry::Point2;
use crate::lanes::{LANES, Level, Simd, SimdBase, SimdFloat, dispatch, f64x8};
use crate::scene::{People, Scene};
use crate::sight::{Sight, View};

/// Term `collision-risk`: `1 - prod_i (1 - max_k P_ik)`, a probability. `P_ik` is the mass of person i's forecast for
/// state k within the two radii; a product over k would count one encounter many times. What is not known of a person
/// now widens its forecast.
#[derive(Debug, Clone)]
pub struct CollisionRiskEvaluator {
    /// The robot's, metres.
    pub radius: f64,
    /// Its greatest speed, m/s.
    pub v_max: f64,
    /// [`crate::collision_risk::RiskParams::standing_share`].
    pub standing_share: f64,
    /// How people move on.
    pub forecast: ForecastParams,
    /// What predicts how well the robot will know its position, whose variance then adds to that of the forecast.
    pub belief: Option<CpcEvaluator>,
    /// What hides people; nothing does if there is none.
    pub sight: Option<Sight>,
}

impl Evaluator for CollisionRiskEvaluator {
    fn evaluate(&self, scene: &Scene, candidates: &CandidateSet, should_stop: &dyn Fn() -> bool) -> Costs {
        let people = &scene.people;
        let states = candidates.all_states();
        let level = Level::new();
        // [candidate, state], m2.
        let mut variances = vec![0.0; states.len()];
        if let Some(belief) = &self.belief {
            belief.along(&scene.belief.covariance, candidates, should_stop, |i, sigmas| {
                for (variance, sigma) in variances[candidates.range(i)].iter_mut().zip(sigmas) {
                    *variance = 0.5 * (sigma[(0, 0)] + sigma[(1, 1)]);
                }
            })?;
        }
        let moments = (0..candidates.steps()).map(|k| {
            let t = (k + 1) as f64 * candidates.dt();
            Moment { means: means_after(people, t), variances: self.variances_after(people, t) }
        });
        let moments: Vec<Moment> = moments.collect();
        let mut contacts = Contacts::new(self.radius + people.radius, people.len());
        let mut view = View::of_each(self.sight.as_ref(), scene, candidates);
        let mut costs = Vec::with_capacity(candidates.len());
        let mut shares = vec![1.0; moments.len()];
        for i in 0..candidates.len() {
            let range = candidates.range(i);
            let x = &states.x[range.clone()];
            let y = &states.y[range.clone()];
            let variances = &variances[range.clone()];
            for (share, v) in shares.iter_mut().zip(&states.v[range]) {
                *share = self.standing_share + (1.0 - self.standing_share) * (v.abs() / self.v_max).min(1.0);
            }
            if should_stop() {
                return Err(Stopped);
            }
            if let Some(view) = &mut view {
                view.trim();
            }
            let of = [x, y, variances, &shares];
            costs.push(dispatch!(level, simd => cost(simd, &mut contacts, &moments, &mut view, of)));
        }
        Ok(costs)
    }
}

/// What is known of people at the time of a state.
struct Moment {
    /// As [`means_after`] has them.
    means: Vec<[[f64; LANES]; 2]>,
    /// Of the forecasts and of what is not known of people now, m2, eight by eight; any beyond the last.
    variances: Vec<[f64; LANES]>,
}

impl CollisionRiskEvaluator {
    /// How badly the positions of all people are known after `t` seconds, m2, eight by eight.
    fn variances_after(&self, people: &People, t: f64) -> Vec<[f64; LANES]> {
        let firsts = (0..people.len()).step_by(LANES);
        firsts.map(|first| std::array::from_fn(|lane| self.variance_after(people, first + lane, t))).collect()
    }

    /// The same of the i-th person; 0 beyond the last.
    fn variance_after(&self, people: &People, i: usize, t: f64) -> f64 {
        if i >= people.len() {
            return 0.0;
        }
        self.forecast.variance_at(people.speed(i), t) + people.variance_after(i, t)
    }
}

/// The cost of one candidate with states at these moments, positions `x` and `y`, and variances of the robot's
/// position.
#[inline(always)]
fn cost<S: Simd>(
    simd: S,
    contacts: &mut Contacts,
    moments: &[Moment],
    view: &mut Option<View<'_>>,
    [x, y, variances, shares]: [&[f64]; 4],
) -> f64 {
    for (k, moment) in moments.iter().enumerate() {
        let p = Point2::new(x[k], y[k]);
        for (group, (means, of_people)) in moment.means.iter().zip(&moment.variances).enumerate() {
            let sigmas: [f64; LANES] = (f64x8::load_array_ref(simd, of_people) + variances[k]).sqrt().into();
            let (mut near, distances) = contacts.near(simd, p, means, &sigmas);
            if near == 0 {
                continue;
            }
            if let Some(view) = view {
                let place = view.place(k, x, y);
                near = in_view(view, place, group, near);
            }
            contacts.add(simd, near, distances, group * LANES, &sigmas, shares[k]);
        }
    }
    1.0 - contacts.free(simd)
}

/// Those of eight people, number `eight`, who are in view of a place.
#[inline(always)]
fn in_view(view: &mut View<'_>, place: usize, eight: usize, near: u64) -> u64 {
    let mut left = near;
    let mut seen = 0;
    while left != 0 {
        let lane = left.trailing_zeros() as usize;
        left &= left - 1;
        seen |= u64::from(view.shows(place, eight * LANES + lane)) << lane;
    }
    seen
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::*;
    use crate::evaluation::cpc::{CpcParams, InformationField, InformationParams};
    use crate::geometry::{Pose2, Twist};
    use crate::motion::OdometryNoise;
    use crate::occupancy::{OccupancyGrid, StaticMap};
    use crate::scene::Belief;
    use crate::sensor::LaserModel;
    use crate::states::States;

    fn scene(people: People, variance: f64) -> Scene {
        let covariance = nalgebra::Matrix3::identity() * variance;
        let belief = Belief { pose: Pose2::new(1.0, 5.0, 0.0), covariance, twist: Twist::default() };
        Scene::new(belief, people)
    }

    /// A robot that goes from (1, 5) to (4, 5).
    fn straight() -> CandidateSet {
        let mut states = States::default();
        (1..=10).for_each(|k| {
            states.push(Pose2::new(1.0 + 0.3 * f64::from(k), 5.0, 0.0), Twist { v: 1.0, omega: 0.0 });
        });
        CandidateSet::new(10, 0.3, vec![0], states).unwrap()
    }

    fn risk(of: &[[f64; 4]], variance: f64, with_belief: bool) -> f64 {
        // Empty: nothing is ever seen, so the position is known no better than at the beginning.
        let grid = OccupancyGrid::new(100, 100, 0.1, Pose2::default(), vec![0; 10_000]).unwrap();
        let laser = LaserModel { range_max: 1.0, ..LaserModel::default() };
        let field = InformationField::new(&StaticMap::new(grid), &laser, &InformationParams::default());
        let cpc = CpcEvaluator::new(Arc::new(field), OdometryNoise::default(), CpcParams::default());
        let forecast = ForecastParams::default();
        let belief = with_belief.then_some(cpc);
        let term = CollisionRiskEvaluator {
            radius: 0.3,
            v_max: 1.0,
            standing_share: 1.0,
            forecast,
            belief,
            sight: None,
        };
        term.evaluate(&scene(People::walking(0.25, of), variance), &straight(), &|| false).unwrap()[0]
    }

    #[test]
    fn a_person_on_the_way_is_nearly_certain_and_one_far_off_is_nothing() {
        assert!(risk(&[[2.5, 5.0, 0.0, 0.0]], 0.01, false) > 0.9);
        assert!(risk(&[[2.5, 8.0, 0.0, 0.0]], 0.01, false) < 1e-9);
        assert_eq!(risk(&[], 0.01, false), 0.0);
    }

    #[test]
    fn a_contact_counts_by_the_speed_of_the_robot_as_far_as_the_share_says() {
        let forecast = ForecastParams::default();
        let cost = |v_max: f64, standing_share: f64| {
            let term = CollisionRiskEvaluator {
                radius: 0.3,
                v_max,
                standing_share,
                forecast,
                belief: None,
                sight: None,
            };
            let people = People::walking(0.25, &[[2.5, 5.0, 0.0, 0.0]]);
            term.evaluate(&scene(people, 0.01), &straight(), &|| false).unwrap()[0]
        };
        // The candidate drives at 1 m/s.
        assert_eq!(cost(1.0, 1.0), cost(4.0, 1.0));
        assert_eq!(cost(1.0, 0.2), cost(1.0, 1.0));
        assert!((cost(4.0, 0.2) - 0.4 * cost(4.0, 1.0)).abs() < 1e-12);
        assert!((cost(4.0, 0.0) - 0.25 * cost(4.0, 1.0)).abs() < 1e-12);
    }

    #[test]
    fn two_persons_count_as_two_and_one_who_stays_beside_counts_once() {
        let one = risk(&[[2.5, 5.6, 0.0, 0.0]], 0.01, false);
        let two = risk(&[[2.5, 5.6, 0.0, 0.0], [2.5, 4.4, 0.0, 0.0]], 0.01, false);
        assert!((two - (1.0 - (1.0 - one) * (1.0 - one))).abs() < 1e-12, "{one} and {two}");
        // One who goes along with the robot is as near at every state; the risk is that of the last, widest forecast.
        let along = risk(&[[1.0, 5.8, 1.0, 0.0]], 0.01, false);
        let at_last = risk(&[[4.0, 5.8, 0.0, 0.0]], 0.01, false);
        assert!(along < 1.05 * at_last && at_last > 0.01, "{along} and {at_last}");
    }

    #[test]
    fn a_robot_that_does_not_know_where_it_is_runs_more_risk_beside_people() {
        let beside = [[2.5, 6.2, 0.0, 0.0]];
        let known = risk(&beside, 0.0025, true);
        let lost = risk(&beside, 0.25, true);
        assert!(lost > 2.0 * known, "{known} and {lost}");
        assert_eq!(risk(&beside, 0.25, false), risk(&beside, 0.0025, false));
    }

    #[test]
    fn what_a_tracker_does_not_know_widens_the_risk_and_errors_of_zero_change_nothing() {
        let term = CollisionRiskEvaluator {
            radius: 0.3,
            v_max: 1.0,
            standing_share: 1.0,
            forecast: ForecastParams::default(),
            belief: None,
            sight: None,
        };
        let cost = |people: People| term.evaluate(&scene(people, 0.01), &straight(), &|| false).unwrap()[0];
        let known = People::walking(0.25, &[[2.5, 6.5, 0.0, 0.0]]);
        let tracked = |position: f64, velocity: f64| People {
            position_variance: vec![position],
            velocity_variance: vec![velocity],
            ..known.clone()
        };
        assert_eq!(cost(tracked(0.0, 0.0)).to_bits(), cost(known.clone()).to_bits());
        assert!(cost(tracked(0.2, 0.0)) > 2.0 * cost(known.clone()));
        assert!(cost(tracked(0.0, 0.1)) > 2.0 * cost(known.clone()));
    }
}
