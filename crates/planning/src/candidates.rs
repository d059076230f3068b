//! Candidate trajectories as a structure of arrays.

use crate::geometry::Pose2;
use crate::states::{Columns, States, StatesError};

/// `count` trajectories of exactly `steps` states each; state k (from 0) is at time `(k + 1) * dt` after
/// the scene's stamp. Every array is `[candidate, step]`, row-major, map frame, finite.
///
/// Private fields, so a set can only hold what [`CandidateSet::new`] has checked.
///
/// ```
/// use curionav_planning::candidates::CandidateSet;
/// use curionav_planning::geometry::{Pose2, Twist};
/// use curionav_planning::states::States;
///
/// let mut states = States::default();
/// for (x, y) in [(0.3, 0.0), (0.6, 0.0), (0.3, 0.1), (0.6, 0.3)] {
///     states.push(Pose2::new(x, y, 0.0), Twist { v: 1.0, omega: 0.0 });
/// }
/// let candidates = CandidateSet::new(2, 0.3, vec![0, 1], states)?;
/// assert_eq!(candidates.states(1).y, [0.1, 0.3]);
/// # Ok::<(), curionav_planning::states::StatesError>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateSet {
    steps: usize,
    dt: f64,
    id: Vec<u32>,
    states: States,
}

impl CandidateSet {
    /// One candidate of `steps` states, `dt` seconds apart, per identifier. Shapes and finiteness are checked
    /// once, for good.
    pub fn new(steps: usize, dt: f64, id: Vec<u32>, states: States) -> Result<Self, StatesError> {
        Self::of_columns(Columns::ALL, steps, dt, id, states)
    }

    /// As [`Self::new`], of which `columns` are known: for an evaluator that reads no other, as
    /// [`BuiltIn::COLUMNS`](crate::terms::BuiltIn::COLUMNS) says. The arrays of the others are empty.
    pub fn of_columns(
        columns: Columns,
        steps: usize,
        dt: f64,
        id: Vec<u32>,
        states: States,
    ) -> Result<Self, StatesError> {
        if steps == 0 || !(dt > 0.0 && dt.is_finite()) {
            return Err(StatesError::Shape);
        }
        states.check(id.len() * steps, columns)?;
        Ok(Self { steps, dt, id, states })
    }

    /// No candidates of `steps` states.
    pub fn empty(steps: usize, dt: f64) -> Self {
        Self { steps, dt, id: Vec::new(), states: States::default() }
    }

    /// Number of candidates.
    pub fn len(&self) -> usize {
        self.id.len()
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.id.is_empty()
    }

    /// States per candidate, K.
    pub fn steps(&self) -> usize {
        self.steps
    }

    /// Seconds between states.
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Identifiers, one per candidate; ties between equal costs go to the lower one.
    pub fn id(&self) -> &[u32] {
        &self.id
    }

    /// The states of all candidates, `[candidate, step]`.
    pub fn all_states(&self) -> &States {
        &self.states
    }

    /// Where candidate `i` lies in each array of [`Self::all_states`].
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        i * self.steps..(i + 1) * self.steps
    }

    /// Where candidate `i` ends; of a set that has all columns.
    pub fn end(&self, i: usize) -> Pose2 {
        self.states.pose(self.range(i).end - 1)
    }

    /// The candidates with these indices, in this order.
    pub fn pick(&self, indices: impl IntoIterator<Item = usize> + Clone) -> Self {
        let states = |array: &[f64]| {
            let mut picked = Vec::with_capacity(indices.clone().into_iter().count() * self.steps);
            indices.clone().into_iter().for_each(|i| picked.extend_from_slice(&array[self.range(i)]));
            picked
        };
        let id = indices.clone().into_iter().map(|i| self.id[i]).collect();
        Self { id, states: self.states.map(states), ..*self }
    }

    /// The candidates of all `sets`, numbered from 0 in order; the sets have `steps` and `dt` in common.
    pub fn concat(steps: usize, dt: f64, sets: Vec<Self>) -> Self {
        debug_assert!(sets.iter().all(|set| (set.steps, set.dt) == (steps, dt)));
        let count = sets.iter().map(Self::len).sum::<usize>() as u32;
        let mut states = States::default();
        sets.into_iter().for_each(|set| states.append(set.states));
        Self { steps, dt, id: (0..count).collect(), states }
    }

    /// The states of candidate `i`.
    pub fn states(&self, i: usize) -> States {
        self.states.map(|array| array[self.range(i)].to_vec())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picked_candidates_keep_their_states_and_order() {
        let n = |k: u32| (0..6).map(|i| f64::from(i * 10 + k)).collect::<Vec<f64>>();
        let states = States { x: n(0), y: n(1), heading: n(2), v: n(3), omega: n(4) };
        let set = CandidateSet::new(2, 0.3, vec![7, 8, 9], states).unwrap();
        assert_eq!(set.pick(1..3).all_states().y, [21.0, 31.0, 41.0, 51.0]);
        assert_eq!(set.pick([2, 0]).id(), [9, 7]);
        let all = CandidateSet::concat(2, 0.3, vec![set.pick(0..1), set.pick(1..3)]);
        assert_eq!((all.id(), all.all_states()), (&[0, 1, 2][..], set.all_states()));
        assert_eq!(set.pick([2, 0]).all_states().x, [40.0, 50.0, 0.0, 10.0]);
    }

    #[test]
    fn shapes_and_numbers_are_checked() {
        let zeros = States::default().map(|_| vec![0.0; 2]);
        let ok = |x: Vec<f64>| CandidateSet::new(2, 0.3, vec![0], States { x, ..zeros.clone() });
        assert!(ok(vec![0.0, 1.0]).is_ok());
        assert_eq!(ok(vec![0.0]), Err(StatesError::Length { array: "x", found: 1, expected: 2 }));
        assert_eq!(ok(vec![0.0, f64::NAN]), Err(StatesError::NotFinite { array: "x", index: 1 }));
    }

    #[test]
    fn a_column_is_there_if_and_only_if_it_was_asked_for() {
        let zeros = vec![0.0; 2];
        let states = States { x: zeros.clone(), y: zeros.clone(), heading: zeros, ..States::default() };
        let of = |columns| CandidateSet::of_columns(columns, 2, 0.3, vec![0], states.clone());
        assert!(of(Columns::POSES).is_ok());
        let wrong = |array, found, expected| Err(StatesError::Length { array, found, expected });
        assert_eq!(of(Columns::POSITIONS), wrong("heading", 2, 0));
        assert_eq!(of(Columns::ALL), wrong("v", 0, 2));
    }
}
