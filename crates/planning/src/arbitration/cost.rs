//! From raw costs to the total L' (eqs. 5 and 6).

use crate::arbitration::Scores;
use crate::numerics::ln;
use crate::profile::{Normalisation, Profile, Term};
use crate::scene::Scene;

/// Greatest cost a term may add: a cost beyond it is as good as none, and no sum of terms overflows.
const MAX_COST: f64 = 1e300;

/// What one active term adds to each candidate's total.
#[derive(Debug, Clone, PartialEq)]
pub struct TermCosts {
    /// The term's name.
    pub term: String,
    /// `weight * scaled raw cost` of each candidate; `None` where the term has not scored it.
    pub cost: Vec<Option<f64>>,
}

/// The cost of each candidate, whole and by term.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Totals {
    /// One entry per active term, by name.
    pub terms: Vec<TermCosts>,
    /// L' of each candidate, finite and not negative; `None` unless every active term has scored it.
    pub total: Vec<Option<f64>>,
}

impl Totals {
    /// The first term that has not scored candidate `index`.
    pub fn missing_term(&self, index: usize) -> Option<&str> {
        self.terms.iter().find(|costs| costs.cost[index].is_none()).map(|costs| costs.term.as_str())
    }

    /// L' of each candidate with the weight of each term times `factor(term)`; `None` where [`Totals::total`] is.
    pub fn reweighted(&self, factor: impl Fn(&str) -> f64) -> Vec<Option<f64>> {
        let factors: Vec<f64> = self.terms.iter().map(|term| factor(&term.term)).collect();
        let sum = |i: usize| {
            let mut terms = self.terms.iter().zip(&factors);
            terms.try_fold(0.0, |sum, (term, factor)| Some(sum + factor * term.cost[i]?))
        };
        (0..self.total.len()).map(sum).collect()
    }
}

/// Weighs the scores of candidates with `steps` states each, for the terms that count in `scene`.
/// Under fixed scales a candidate's total depends on its own scores alone.
pub fn total_costs(profile: &Profile, scene: &Scene, steps: usize, scores: &Scores) -> Totals {
    let count = scores.len();
    let active: Vec<(&str, &Term)> = profile.active_terms(scene.uncertain).collect();
    let complete: Vec<bool> =
        (0..count).map(|i| active.iter().all(|(name, _)| scores.cost(name, i).is_some())).collect();
    let raw: Vec<Vec<Option<f64>>> =
        active.iter().map(|(name, _)| (0..count).map(|i| scores.cost(name, i)).collect()).collect();
    let shares = match profile.normalisation {
        Normalisation::Entropy => entropy_weights(&raw, &complete),
        Normalisation::Fixed | Normalisation::MinMax => vec![1.0; active.len()],
    };
    let mut terms = Vec::with_capacity(active.len());
    for (((name, term), raw), share) in active.into_iter().zip(raw).zip(shares) {
        let (origin, unit) = match profile.normalisation {
            Normalisation::Fixed => (0.0, term.scale * steps as f64),
            Normalisation::MinMax | Normalisation::Entropy => span(&raw, &complete),
        };
        let weight = profile.weight(term, scene.impatient) * share;
        let scaled = |raw: f64| Some(weight * ((raw - origin) / unit)).filter(|cost| *cost <= MAX_COST);
        let cost = raw.into_iter().map(|raw| raw.and_then(scaled)).collect();
        terms.push(TermCosts { term: name.to_owned(), cost });
    }
    let sum = |i: usize| terms.iter().try_fold(0.0, |sum, term| Some(sum + term.cost[i]?));
    let total = (0..count).map(sum).collect();
    Totals { terms, total }
}

/// Least raw cost and range among the complete candidates; a range of zero counts as one, so that a
/// term that is equal for all adds nothing.
fn span(raw: &[Option<f64>], complete: &[bool]) -> (f64, f64) {
    let competing = competing(raw, complete);
    let least = competing.clone().fold(f64::INFINITY, f64::min);
    let range = competing.fold(0.0, f64::max) - least;
    if range > 0.0 {
        (least, range)
    } else if least.is_finite() {
        (least, 1.0)
    } else {
        (0.0, 1.0)
    }
}

/// How much each term tells the complete candidates apart, as shares of one: `1 - e` with the entropy `e = - sum s ln s
/// / ln I` of `s = y / sum y`, where `y` is 1 for the least cost and 0 for the greatest of I. All zero if no term tells
/// any apart.
fn entropy_weights(raw: &[Vec<Option<f64>>], complete: &[bool]) -> Vec<f64> {
    let told: Vec<f64> = raw.iter().map(|raw| tells_apart(raw, complete)).collect();
    let sum: f64 = told.iter().sum();
    told.into_iter().map(|told| if sum > 0.0 { told / sum } else { 0.0 }).collect()
}

/// `1 - e` of one term.
fn tells_apart(raw: &[Option<f64>], complete: &[bool]) -> f64 {
    let (least, range) = span(raw, complete);
    let y: Vec<f64> = competing(raw, complete).map(|raw| 1.0 - (raw - least) / range).collect();
    // Where all cost the same, all have the least.
    if y.iter().all(|y| *y == 1.0) {
        return 0.0;
    }
    let sum: f64 = y.iter().sum();
    let shares = y.iter().map(|y| y / sum);
    let entropy = shares.map(|share| if share > 0.0 { share * ln(share) } else { 0.0 }).sum::<f64>();
    (1.0 + entropy / ln(y.len() as f64)).max(0.0)
}

/// The raw costs of the complete candidates.
fn competing<'a>(raw: &'a [Option<f64>], complete: &'a [bool]) -> impl Iterator<Item = f64> + Clone + 'a {
    raw.iter().zip(complete).filter(|(_, complete)| **complete).filter_map(|(raw, _)| *raw)
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;
    use crate::geometry::{Pose2, Twist};
    use crate::scene::{Belief, People};

    fn scene(uncertain: bool) -> Scene {
        let pose = Pose2::default();
        let twist = Twist::default();
        let belief = Belief { pose, covariance: nalgebra::Matrix3::zeros(), twist };
        Scene { uncertain, ..Scene::new(belief, People::default()) }
    }

    fn scores(columns: &[(&str, &[f64])]) -> Scores {
        let mut scores = Scores::new(columns[0].1.len());
        for (term, costs) in columns {
            scores.insert(term, 0, costs).unwrap();
        }
        scores
    }

    /// With every weight 1.
    fn profile(normalisation: Normalisation) -> Profile {
        let mut profile = Profile { normalisation, ..Profile::default() };
        profile.terms.values_mut().for_each(|term| term.weight = 1.0);
        profile
    }

    #[test]
    fn by_entropy_a_term_counts_as_much_as_it_tells_candidates_apart() {
        let mut profile = profile(Normalisation::Entropy);
        profile.terms = ["even", "flat", "sharp"].map(|name| (name.to_owned(), Term::new(1.0, 1.0))).into();
        // One candidate stands out under `sharp`; `even` spreads them; `flat` says nothing.
        let columns: [(&str, &[f64]); 3] =
            [("even", &[0.0, 1.0, 2.0, 3.0]), ("flat", &[7.0; 4]), ("sharp", &[9.0, 9.0, 9.0, 0.0])];
        let totals = total_costs(&profile, &scene(true), 1, &scores(&columns));
        let greatest = |term: usize| totals.terms[term].cost.iter().flatten().copied().fold(0.0, f64::max);
        // s of `even` is 1/2, 1/3, 1/6 and 0, its entropy 1.0114 of ln 4; s of `sharp` is 0, 0, 0 and 1.
        let [even, flat, sharp] = [0, 1, 2].map(greatest);
        assert_eq!(flat, 0.0);
        assert!(
            (even - 0.27040 / 1.27040).abs() < 1e-4 && (sharp - 1.0 / 1.27040).abs() < 1e-4,
            "{even} {sharp}"
        );
        let best =
            |totals: &Totals| (0..4).min_by(|&a, &b| totals.total[a].partial_cmp(&totals.total[b]).unwrap());
        assert_eq!(best(&totals), Some(3));
        // One candidate alone, and none, are no reason to fail.
        for count in [0, 1] {
            let few = columns.map(|(name, costs)| (name, &costs[..count]));
            assert!(
                total_costs(&profile, &scene(true), 1, &scores(&few))
                    .total
                    .iter()
                    .all(|total| *total == Some(0.0))
            );
        }
    }

    #[test]
    fn weights_by_entropy_are_those_of_another_implementation() {
        const COUNT: usize = 8;
        let rows = include_str!("cost/reference.txt").lines().filter(|line| !line.starts_with('#'));
        for row in rows.clone() {
            let numbers: Vec<f64> = row.split(' ').map(|word| word.parse().unwrap()).collect();
            let raw: Vec<Vec<Option<f64>>> = numbers[..3 * COUNT]
                .chunks(COUNT)
                .map(|term| term.iter().copied().map(Some).collect())
                .collect();
            let found = entropy_weights(&raw, &[true; COUNT]);
            for (found, expected) in found.iter().zip(&numbers[3 * COUNT..]) {
                assert!((found - expected).abs() < 1e-9, "{row}: {found}");
            }
            assert_eq!(found.len(), numbers.len() - 3 * COUNT);
        }
        assert_eq!(rows.count(), 8);
    }

    #[test]
    fn the_total_is_equation_5() {
        let profile = profile(Normalisation::Fixed);
        let s = scores(&[("cnc", &[1.378]), ("cpc", &[2.6]), ("distance", &[52.0])]);
        // K = 13: 1.378 / (13 * 0.106) = 1, 52 / (13 * 2) = 2, 2.6 / (13 * 0.1) = 2
        let sure = total_costs(&profile, &scene(false), 13, &s).total[0].unwrap();
        let unsure = total_costs(&profile, &scene(true), 13, &s).total[0].unwrap();
        assert!((sure - 3.0).abs() < 1e-12 && (unsure - 5.0).abs() < 1e-12);
    }

    #[test]
    fn a_term_that_gives_way_counts_less_while_the_robot_is_impatient() {
        let mut profile = profile(Normalisation::Fixed);
        profile.terms.get_mut("cnc").unwrap().gives_way = true;
        profile.patience.share = 0.25;
        let s = scores(&[("cnc", &[1.378]), ("distance", &[52.0])]);
        let total = |impatient| {
            let scene = Scene { impatient, ..scene(false) };
            total_costs(&profile, &scene, 13, &s).total[0].unwrap()
        };
        assert!((total(false) - 3.0).abs() < 1e-12 && (total(true) - 2.25).abs() < 1e-12);
    }

    #[test]
    fn min_max_stretches_each_term_over_the_batch() {
        let profile = profile(Normalisation::MinMax);
        let s = scores(&[("cnc", &[0.5, 0.5, 0.5]), ("distance", &[10.0, 12.0, 11.0])]);
        assert_eq!(total_costs(&profile, &scene(false), 13, &s).total, [Some(0.0), Some(1.0), Some(0.5)]);
    }

    #[test]
    fn a_candidate_without_every_score_has_no_total_and_no_say_in_min_max() {
        let profile = profile(Normalisation::MinMax);
        let s = scores(&[("cnc", &[0.0, 1.0, f64::NAN]), ("distance", &[10.0, 12.0, 9999.0])]);
        let totals = total_costs(&profile, &scene(false), 13, &s);
        assert_eq!(totals.total, [Some(0.0), Some(2.0), None]);
        assert_eq!(totals.missing_term(2), Some("cnc"));
        assert_eq!(totals.missing_term(1), None);
    }

    proptest! {
        #[test]
        fn totals_are_finite_or_absent_whatever_is_scored(
            cnc in prop::collection::vec(prop::num::f64::ANY, 1..20),
            distance in prop::num::f64::ANY,
            weight in prop::num::f64::POSITIVE,
            min_max in any::<bool>(),
        ) {
            let mut profile = Profile::default();
            profile.terms.get_mut("cnc").unwrap().weight = weight;
            profile.normalisation = if min_max { Normalisation::MinMax } else { Normalisation::Fixed };
            let mut s = Scores::new(cnc.len());
            s.insert("cnc", 0, &cnc).unwrap();
            s.insert("distance", 0, &vec![distance; cnc.len()]).unwrap();
            for total in total_costs(&profile, &scene(false), 13, &s).total.into_iter().flatten() {
                prop_assert!(total.is_finite());
                prop_assert!(total >= 0.0);
            }
        }

        #[test]
        fn under_fixed_scales_a_total_depends_on_its_own_candidate_alone(
            cnc in prop::collection::vec(0.0..5.0, 2..20),
            at in any::<prop::sample::Index>(),
        ) {
            let profile = Profile::default();
            let i = at.index(cnc.len());
            let distance: Vec<f64> = cnc.iter().map(|c| 10.0 - c).collect();
            let all = scores(&[("cnc", &cnc), ("distance", &distance)]);
            let all = total_costs(&profile, &scene(false), 13, &all);
            let own = scores(&[("cnc", &cnc[i..=i]), ("distance", &distance[i..=i])]);
            prop_assert_eq!(all.total[i], total_costs(&profile, &scene(false), 13, &own).total[0]);
        }
    }
}
