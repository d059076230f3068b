//! Raw costs as they come in: by term, in shards, from anywhere.

use std::collections::BTreeMap;

/// Costs that do not fit the candidates they were asked for.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{found} costs of `{term}` from candidate {first} on, but there are {count} candidates")]
pub struct ScoreError {
    term: String,
    first: usize,
    found: usize,
    count: usize,
}

/// The raw cost of each candidate under each term, where known. Held costs are finite and not negative.
#[derive(Debug, Clone, PartialEq, Default)]
pub struct Scores {
    count: usize,
    costs: BTreeMap<String, Vec<Option<f64>>>,
}

impl Scores {
    /// No scores yet for `count` candidates.
    pub fn new(count: usize) -> Self {
        Self { count, costs: BTreeMap::new() }
    }

    /// Number of candidates.
    pub fn len(&self) -> usize {
        self.count
    }

    /// Whether there are no candidates.
    pub fn is_empty(&self) -> bool {
        self.count == 0
    }

    /// Adds the costs of one shard, whose first candidate has index `first`, and says how many of them
    /// were refused for being NaN, infinite or negative; those candidates stay unscored. A candidate
    /// scored twice keeps its first cost: equal costs are the contract, and order must not matter.
    pub fn insert(&mut self, term: &str, first: usize, costs: &[f64]) -> Result<usize, ScoreError> {
        let end = first.checked_add(costs.len()).filter(|&end| end <= self.count).ok_or_else(|| {
            ScoreError { term: term.to_owned(), first, found: costs.len(), count: self.count }
        })?;
        let held = self.costs.entry(term.to_owned()).or_insert_with(|| vec![None; self.count]);
        let mut refused = 0;
        for (slot, &cost) in held[first..end].iter_mut().zip(costs) {
            if !(cost.is_finite() && cost >= 0.0) {
                refused += 1;
            } else if slot.is_none() {
                *slot = Some(cost);
            }
        }
        Ok(refused)
    }

    /// The raw cost of candidate `index` under `term`, in the term's unit.
    pub fn cost(&self, term: &str, index: usize) -> Option<f64> {
        self.costs.get(term).and_then(|costs| costs.get(index).copied().flatten())
    }

    /// Indices of the candidates that `term` has not scored, ascending.
    pub fn missing(&self, term: &str) -> Vec<usize> {
        (0..self.count).filter(|&i| self.cost(term, i).is_none()).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_may_arrive_in_any_order() {
        let mut a = Scores::new(4);
        let mut b = Scores::new(4);
        a.insert("cnc", 0, &[1.0, 2.0]).unwrap();
        assert_eq!(a.missing("cnc"), [2, 3]);
        assert_eq!(a.missing("cpc"), [0, 1, 2, 3]);
        a.insert("cnc", 2, &[3.0, 4.0]).unwrap();
        b.insert("cnc", 2, &[3.0, 4.0]).unwrap();
        b.insert("cnc", 0, &[1.0, 2.0]).unwrap();
        assert_eq!(a, b);
        assert!(a.missing("cnc").is_empty());
    }

    #[test]
    fn garbage_leaves_its_candidate_unscored() {
        let mut scores = Scores::new(5);
        assert_eq!(scores.insert("cnc", 0, &[f64::NAN, 1.0, f64::INFINITY, -1.0, 0.0]), Ok(3));
        assert_eq!(scores.missing("cnc"), [0, 2, 3]);
        // and can be mended by another replica
        assert_eq!(scores.insert("cnc", 0, &[7.0]), Ok(0));
        assert_eq!(scores.cost("cnc", 0), Some(7.0));
    }

    #[test]
    fn a_shard_outside_the_batch_changes_nothing() {
        let mut scores = Scores::new(2);
        let before = scores.clone();
        assert!(scores.insert("cnc", 1, &[1.0, 1.0]).is_err());
        assert!(scores.insert("cnc", usize::MAX, &[1.0]).is_err());
        assert_eq!(scores, before);
    }
}
