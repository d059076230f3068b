//! Claims about explanations.

use proptest::prelude::*;

use super::hall::*;
use super::*;
use crate::arbitration::explanation::explain_by;
use crate::arbitration::{Explanation, explain};

fn explained(
    hall: &Hall,
    candidates: &CandidateSet,
    s: &Scores,
    p: Option<&Previous>,
) -> (Verdict, Explanation) {
    let verdict = hall.arbitrate(candidates, s, p);
    let explanation = explain(&hall.context(candidates, p), &verdict);
    (verdict, explanation)
}

#[test]
fn an_explanation_says_how_close_it_was_and_who_wanted_what() {
    let s = scores(&[("cnc", &[1.378, 0.0, 0.689]), ("distance", &[26.0, 78.0, 52.0])]);
    // totals: 1 + 1, 0 + 3, 0.5 + 2
    let (verdict, explanation) = explained(&Hall::new(), &three(), &s, None);
    assert_eq!((verdict.chosen, explanation.runner_up), (Some(0), Some(2)));
    assert!((explanation.margin.unwrap() - 0.5).abs() < 1e-12);
    let [cnc, distance] = &explanation.terms[..] else { panic!("{explanation:?}") };
    assert_eq!((cnc.alone, distance.alone), (Some(1), Some(0)));
    assert_eq!((cnc.without, distance.without), (Some(0), Some(1)));
    // doubled: 2 + 1, 0 + 3, 1 + 2: the least id of three equal totals
    assert_eq!((cnc.doubled, distance.doubled), (Some(1), Some(0)));
    // halved: 1 + 0.5, 0 + 1.5, 0.5 + 1
    assert_eq!((cnc.halved, distance.halved), (Some(0), Some(1)));
}

#[test]
fn without_candidates_there_is_nothing_to_explain() {
    let none = CandidateSet::empty(STEPS, DT);
    assert_eq!(explained(&Hall::new(), &none, &Scores::new(0), None).1, Explanation::default());
}

#[test]
fn no_candidate_that_collides_is_named() {
    let mut hall = Hall::new();
    hall.add_person(22.0, 20.0);
    hall.add_person(20.0, 22.0);
    // Ahead is blocked and best for both, left is blocked and second.
    let s = scores(&[("cnc", &[0.0, 0.1, 0.2]), ("distance", &[10.0, 20.0, 30.0])]);
    let (verdict, explanation) = explained(&hall, &three(), &s, None);
    assert_eq!((verdict.chosen, explanation.runner_up, explanation.margin), (Some(2), None, None));
    for term in &explanation.terms {
        assert_eq!(
            (term.alone, term.without, term.doubled, term.halved),
            (Some(2), Some(2), Some(2), Some(2))
        );
    }
}
#[test]
fn the_only_term_cannot_be_left_out() {
    let mut hall = Hall::new();
    hall.profile = Profile::builtin("distance-only").unwrap();
    let (_, explanation) = explained(&hall, &three(), &scores(&[("distance", &[3.0, 2.0, 1.0])]), None);
    assert_eq!(explanation.terms.len(), 1);
    assert_eq!((explanation.terms[0].alone, explanation.terms[0].without), (Some(2), None));
}

#[test]
fn no_trajectory_is_checked_twice() {
    let s = scores(&[("cnc", &[1.378, 0.0, 0.689]), ("distance", &[26.0, 78.0, 52.0])]);
    let hall = Hall::new();
    let verdict = hall.arbitrate(&three(), &s, None);
    let checks = Cell::new(0);
    let free = |_: &Trajectory| {
        checks.set(checks.get() + 1);
        None
    };
    explain_by(&hall.context(&three(), None), &verdict, &free);
    // The chosen one is known to be free.
    assert_eq!(checks.get(), 2);
}

proptest! {
    #[test]
    fn a_weight_that_is_said_to_change_the_choice_does(
        cnc in prop::collection::vec(0.0..3.0, 3),
        distance in prop::collection::vec(0.0..80.0, 3),
        blocked in 0..4_usize,
        margin in prop_oneof![Just(0.0), 0.0..0.5],
    ) {
        let mut hall = Hall::new();
        let (x, y) = [(22.0, 20.0), (20.2, 22.0), (20.2, 18.0), (30.0, 30.0)][blocked];
        hall.add_person(x, y);
        hall.profile.persistence.margin = margin;
        let s = scores(&[("cnc", &cnc), ("distance", &distance)]);
        let p = previous(1.5, 0.3);
        let (_, explanation) = explained(&hall, &three(), &s, Some(&p));
        for term in &explanation.terms {
            for (factor, said) in [(2.0, term.doubled), (0.5, term.halved)] {
                hall.profile.terms.get_mut(&term.term).unwrap().weight = factor;
                prop_assert_eq!(hall.arbitrate(&three(), &s, Some(&p)).chosen, said);
                hall.profile.terms.get_mut(&term.term).unwrap().weight = 1.0;
            }
        }
    }
}
