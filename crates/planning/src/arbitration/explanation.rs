//! How close a decision was, and who wanted what: for reports and people.

use crate::arbitration::Verdict;

/// A verdict seen from outside. Indices are those of the batch.
#[derive(Debug, Clone, PartialEq)]
pub struct Explanation {
    /// The candidate of least total besides the chosen one, among those not rejected. It was not
    /// checked for collisions if the chosen one was free at once.
    pub runner_up: Option<usize>,
    /// Its total minus that of the chosen one; below zero only if persistence kept a dearer one.
    pub margin: Option<f64>,
    /// By active term: the candidate that the term alone would have chosen, among those not rejected.
    pub by_term: Vec<(String, Option<usize>)>,
}

impl Verdict {
    /// Explains this verdict about candidates with these ids.
    pub fn explain(&self, id: &[u32]) -> Explanation {
        let running: Vec<usize> = (0..self.rejected.len()).filter(|&i| self.rejected[i].is_none()).collect();
        let least = |cost: &[Option<f64>], except: Option<usize>| {
            let scored = running.iter().filter(|&&i| Some(i) != except).filter_map(|&i| Some((i, cost[i]?)));
            scored.min_by(|(i, a), (j, b)| a.total_cmp(b).then(id[*i].cmp(&id[*j]))).map(|(i, _)| i)
        };
        let total = &self.totals.total;
        let runner_up = self.chosen.and_then(|chosen| least(total, Some(chosen)));
        let margin = self.chosen.zip(runner_up).and_then(|(a, b)| Some(total[b]? - total[a]?));
        let by_term =
            self.totals.terms.iter().map(|term| (term.metric.clone(), least(&term.cost, None))).collect();
        Explanation { runner_up, margin, by_term }
    }
}
