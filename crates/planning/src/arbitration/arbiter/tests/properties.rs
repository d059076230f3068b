use proptest::prelude::*;

use super::*;

/// One random candidate: direction, speed, and the three raw costs, some of them unusable.
type Way = (f64, f64, f64, f64, f64);

fn ways() -> impl Strategy<Value = Vec<Way>> {
    let cost = || prop_oneof![8 => (0_u8..4).prop_map(f64::from), 1 => Just(f64::NAN), 1 => Just(-1.0)];
    prop::collection::vec((-3.0..3.0, 0.0..1.0, cost(), cost(), cost()), 0..12)
}

fn crowded_hall(people: &[(f64, f64)], uncertain: bool, min_max: bool) -> Hall {
    let mut hall = Hall::new();
    hall.scene.uncertain = uncertain;
    people.iter().for_each(|&(x, y)| hall.add_person(20.0 + x, 20.0 + y));
    hall.profile.normalisation = if min_max { Normalisation::MinMax } else { Normalisation::Fixed };
    hall
}

fn batch(ids: &[u32], ways: &[Way]) -> (CandidateSet, Scores) {
    let fanned: Vec<(u32, f64, f64)> = ids.iter().zip(ways).map(|(&id, w)| (id, w.0, w.1)).collect();
    let mut scores = Scores::new(ways.len());
    scores.insert("cnc", 0, &ways.iter().map(|w| w.2).collect::<Vec<_>>()).unwrap();
    scores.insert("distance", 0, &ways.iter().map(|w| 10.0 * w.3).collect::<Vec<_>>()).unwrap();
    scores.insert("cpc", 0, &ways.iter().map(|w| w.4).collect::<Vec<_>>()).unwrap();
    (fan(&fanned), scores)
}

/// Checks everything first and then takes the least: the obvious way to decide.
fn exhaustive(hall: &Hall, candidates: &CandidateSet, scores: &Scores) -> Option<u32> {
    let checker = CollisionChecker::new(
        &hall.map,
        &hall.robot,
        &hall.scene,
        hall.profile.forecast,
        &hall.profile.collision,
    );
    let total = total_costs(&hall.profile, &hall.scene, STEPS, scores).total;
    let free = (0..candidates.len())
        .filter(|&i| total[i].is_some() && checker.first_collision(&candidates.states(i), DT).is_none());
    let speed = |i: usize| candidates.all_states().v[candidates.range(i)].iter().sum::<f64>() / STEPS as f64;
    // The robot looks along the first axis.
    let turn = |i: usize| candidates.all_states().heading[candidates.range(i)][STEPS - 1].abs();
    let slow = hall.robot.slow_below(0.35, hall.scene.belief.twist.v, STEPS, DT);
    free.map(|i| (speed(i) < slow && turn(i) < 0.75, total[i].unwrap(), candidates.id()[i]))
        .min_by(|a, b| a.partial_cmp(b).unwrap())
        .map(|best| best.2)
}

proptest! {
    #[test]
    fn the_lazy_check_decides_as_the_exhaustive_one(
        ways in ways(),
        people in prop::collection::vec((-3.0..3.0, -3.0..3.0), 0..6),
        uncertain in any::<bool>(),
        min_max in any::<bool>(),
    ) {
        let hall = crowded_hall(&people, uncertain, min_max);
        let (candidates, scores) = batch(&(0..ways.len() as u32).collect::<Vec<_>>(), &ways);
        let verdict = hall.arbitrate(&candidates, &scores, None);
        prop_assert_eq!(verdict.decision.candidate, exhaustive(&hall, &candidates, &scores));
        prop_assert_eq!(&verdict, &hall.arbitrate(&candidates, &scores, None));
        if let Some(chosen) = verdict.chosen {
            prop_assert!(scores.cost("cnc", chosen).is_some() && scores.cost("distance", chosen).is_some());
            prop_assert!(!uncertain || scores.cost("cpc", chosen).is_some());
            prop_assert_eq!(&verdict.rejected[chosen], &None);
        }
    }

    #[test]
    fn the_order_of_candidates_does_not_matter(
        (ways, order) in ways().prop_flat_map(|w| {
            let order = Just((0..w.len()).collect::<Vec<_>>()).prop_shuffle();
            (Just(w), order)
        }),
        people in prop::collection::vec((-3.0..3.0, -3.0..3.0), 0..6),
        min_max in any::<bool>(),
    ) {
        let hall = crowded_hall(&people, true, min_max);
        let ids: Vec<u32> = (0..ways.len() as u32).collect();
        let (candidates, scores) = batch(&ids, &ways);
        let shuffled_ids: Vec<u32> = order.iter().map(|&i| ids[i]).collect();
        let shuffled_ways: Vec<Way> = order.iter().map(|&i| ways[i]).collect();
        let (shuffled, shuffled_scores) = batch(&shuffled_ids, &shuffled_ways);
        let straight = hall.arbitrate(&candidates, &scores, Some(&previous(0.0, 0.3)));
        let other = hall.arbitrate(&shuffled, &shuffled_scores, Some(&previous(0.0, 0.3)));
        prop_assert_eq!(straight.decision, other.decision);
        for (place, &i) in order.iter().enumerate() {
            prop_assert_eq!(&straight.rejected[i], &other.rejected[place]);
            prop_assert_eq!(straight.totals.total[i], other.totals.total[place]);
        }
    }

    #[test]
    fn removing_a_loser_changes_no_decision_under_fixed_scales(
        ways in ways(),
        people in prop::collection::vec((-3.0..3.0, -3.0..3.0), 0..6),
        at in any::<prop::sample::Index>(),
    ) {
        let hall = crowded_hall(&people, true, false);
        let ids: Vec<u32> = (0..ways.len() as u32).collect();
        let (candidates, scores) = batch(&ids, &ways);
        let all = hall.arbitrate(&candidates, &scores, None);
        prop_assume!(all.chosen.is_some() && ways.len() > 1);
        let gone = at.index(ways.len());
        prop_assume!(Some(gone) != all.chosen);
        let keep = |i: &usize| *i != gone;
        let fewer_ids: Vec<u32> = (0..ways.len()).filter(keep).map(|i| ids[i]).collect();
        let fewer_ways: Vec<Way> = (0..ways.len()).filter(keep).map(|i| ways[i]).collect();
        let (fewer, fewer_scores) = batch(&fewer_ids, &fewer_ways);
        let mut found = hall.arbitrate(&fewer, &fewer_scores, None).decision;
        if all.rejected[gone].is_some() {
            // Without the one that cost less and collided, the same candidate is the one of least cost.
            found.reason = all.decision.reason.clone();
        }
        prop_assert_eq!(found, all.decision);
    }
}
