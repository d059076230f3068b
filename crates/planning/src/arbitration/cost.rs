//! From raw costs to the total L' (eqs. 5 and 6).

use crate::arbitration::Scores;
use crate::profile::{Normalisation, Profile, Term};

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

/// Weighs the scores of a scene that is `uncertain` or not, of candidates with `steps` states each.
/// Under fixed scales a candidate's total depends on its own scores alone.
pub fn total_costs(profile: &Profile, uncertain: bool, steps: usize, scores: &Scores) -> Totals {
    let count = scores.len();
    let active: Vec<(&str, &Term)> = profile.active_terms(uncertain).collect();
    let complete: Vec<bool> =
        (0..count).map(|i| active.iter().all(|(name, _)| scores.cost(name, i).is_some())).collect();
    let mut terms = Vec::with_capacity(active.len());
    for (name, term) in active {
        let raw: Vec<Option<f64>> = (0..count).map(|i| scores.cost(name, i)).collect();
        let (origin, unit) = match profile.normalisation {
            Normalisation::Fixed => (0.0, term.scale * steps as f64),
            Normalisation::MinMax => span(&raw, &complete),
        };
        let scaled = |raw: f64| Some(term.weight * ((raw - origin) / unit)).filter(|cost| *cost <= MAX_COST);
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
    let competing =
        || raw.iter().zip(complete).filter(|(_, complete)| **complete).filter_map(|(raw, _)| *raw);
    let least = competing().fold(f64::INFINITY, f64::min);
    let range = competing().fold(0.0, f64::max) - least;
    if range > 0.0 { (least, range) } else { (if least.is_finite() { least } else { 0.0 }, 1.0) }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;

    use super::*;

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
    fn the_total_is_equation_5() {
        let profile = profile(Normalisation::Fixed);
        let s = scores(&[("cnc", &[1.378]), ("cpc", &[2.6]), ("distance", &[52.0])]);
        // K = 13: 1.378 / (13 * 0.106) = 1, 52 / (13 * 2) = 2, 2.6 / (13 * 0.1) = 2
        let sure = total_costs(&profile, false, 13, &s).total[0].unwrap();
        let unsure = total_costs(&profile, true, 13, &s).total[0].unwrap();
        assert!((sure - 3.0).abs() < 1e-12 && (unsure - 5.0).abs() < 1e-12);
    }

    #[test]
    fn min_max_stretches_each_term_over_the_batch() {
        let profile = profile(Normalisation::MinMax);
        let s = scores(&[("cnc", &[0.5, 0.5, 0.5]), ("distance", &[10.0, 12.0, 11.0])]);
        assert_eq!(total_costs(&profile, false, 13, &s).total, [Some(0.0), Some(1.0), Some(0.5)]);
    }

    #[test]
    fn a_candidate_without_every_score_has_no_total_and_no_say_in_min_max() {
        let profile = profile(Normalisation::MinMax);
        let s = scores(&[("cnc", &[0.0, 1.0, f64::NAN]), ("distance", &[10.0, 12.0, 9999.0])]);
        let totals = total_costs(&profile, false, 13, &s);
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
            for total in total_costs(&profile, false, 13, &s).total.into_iter().flatten() {
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
            let all = total_costs(&profile, false, 13, &scores(&[("cnc", &cnc), ("distance", &distance)]));
            let own = scores(&[("cnc", &cnc[i..=i]), ("distance", &distance[i..=i])]);
            prop_assert_eq!(all.total[i], total_costs(&profile, false, 13, &own).total[0]);
        }
    }
}
