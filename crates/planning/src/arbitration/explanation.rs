//! How close a decision was, who wanted what, and what other weights would have led to: for reports and people.
//!
//! Every answer is found as the decision itself is: the least total among what is scored, reachable and free of
//! collision. A candidate that the decision had no need to check is checked here before it is named.

use std::cell::RefCell;

use crate::arbitration::arbiter::{CollisionCheck, Contender, contenders};
use crate::arbitration::{Context, Rejection, Totals, Verdict};
use crate::candidates::CandidateSet;
use crate::geometry::{Pose2, Twist};
use crate::trajectory::Trajectory;

/// A verdict seen from outside. Indices are those of the batch; all is empty if no candidate was followed, for then
/// no weights would have led to one.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Explanation {
    /// The candidate that would have been followed without the chosen one.
    pub runner_up: Option<usize>,
    /// Its total minus that of the chosen one; below zero only if the chosen one was not preferred for its cost:
    /// it is faster (D4) or goes on with what was decided before.
    pub margin: Option<f64>,
    /// What each active term had to say.
    pub terms: Vec<TermInfluence>,
}

/// Which candidate would have been followed, had one term another weight.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct TermInfluence {
    /// The term's name.
    pub term: String,
    /// By this term alone.
    pub alone: Option<usize>,
    /// With a weight of zero; absent if no other term is left.
    pub without: Option<usize>,
    /// With twice the weight.
    pub doubled: Option<usize>,
    /// With half the weight.
    pub halved: Option<usize>,
}

/// Explains `verdict`, the outcome of [`arbitrate`](crate::arbitration::arbitrate) for the same inputs.
pub fn explain(context: &Context<'_>, verdict: &Verdict) -> Explanation {
    let checker = context.checker();
    explain_by(context, verdict, &|t| checker.first_collision(t.states(), t.dt()))
}

pub(super) fn explain_by(
    context: &Context<'_>,
    verdict: &Verdict,
    first_collision: &CollisionCheck<'_>,
) -> Explanation {
    let Some(chosen) = verdict.chosen else { return Explanation::default() };
    let totals = &verdict.totals;
    let competition = Competition {
        candidates: context.candidates,
        contenders: contenders(context, &may_compete(verdict)),
        free: RefCell::new(verdict.rejected.iter().map(known).collect()),
        first_collision,
        start: context.scene.belief.motion(),
    };
    competition.free.borrow_mut()[chosen] = Some(true);
    let runner_up = competition.best(&totals.total, Some(chosen));
    let margin = runner_up.and_then(|second| Some(totals.total[second]? - totals.total[chosen]?));
    let terms = totals.terms.iter().map(|term| competition.influence(totals, &term.term)).collect();
    Explanation { runner_up, margin, terms }
}

/// Whether each candidate may win: every term has scored it, and the robot can reach it.
fn may_compete(verdict: &Verdict) -> Vec<bool> {
    let barred = |r: &Option<Rejection>| {
        matches!(r, Some(Rejection::NotScored { .. } | Rejection::Unreachable { .. }))
    };
    verdict.rejected.iter().map(|rejection| !barred(rejection)).collect()
}

/// What the decision has found out about a candidate's freedom.
fn known(rejection: &Option<Rejection>) -> Option<bool> {
    matches!(rejection, Some(Rejection::Collides(_))).then_some(false)
}

/// Those who compete, and what is known of their freedom so far.
struct Competition<'a> {
    candidates: &'a CandidateSet,
    contenders: Vec<Contender>,
    free: RefCell<Vec<Option<bool>>>,
    first_collision: &'a CollisionCheck<'a>,
    start: (Pose2, Twist),
}

impl Competition<'_> {
    fn influence(&self, totals: &Totals, term: &str) -> TermInfluence {
        let with = |factor: f64| {
            self.best(&totals.reweighted(|other| if other == term { factor } else { 1.0 }), None)
        };
        TermInfluence {
            term: term.to_owned(),
            alone: self.best(&totals.reweighted(|other| if other == term { 1.0 } else { 0.0 }), None),
            without: if totals.terms.len() > 1 { with(0.0) } else { None },
            doubled: with(2.0),
            halved: with(0.5),
        }
    }

    /// The one to be followed for these totals, if `except` was not there.
    fn best(&self, total: &[Option<f64>], except: Option<usize>) -> Option<usize> {
        let id = self.candidates.id();
        let cost = |c: &Contender| total[c.index].unwrap_or(f64::INFINITY) - c.discount;
        loop {
            let free = self.free.borrow();
            let open = self.contenders.iter().filter(|c| Some(c.index) != except);
            let best = open.filter(|c| free[c.index] != Some(false)).min_by(|a, b| {
                a.slow.cmp(&b.slow).then(cost(a).total_cmp(&cost(b))).then(id[a.index].cmp(&id[b.index]))
            })?;
            let index = best.index;
            let is_free = free[best.index];
            drop(free);
            let is_free = is_free.unwrap_or_else(|| {
                (self.first_collision)(&Trajectory::of(self.candidates, index, self.start)).is_none()
            });
            self.free.borrow_mut()[index] = Some(is_free);
            if is_free {
                return Some(index);
            }
        }
    }
}
