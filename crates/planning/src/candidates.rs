//! Candidate trajectories as a structure of arrays.

/// What is wrong with arrays that were to become a [`CandidateSet`].
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum CandidateError {
    /// An array's length is not `count * steps`.
    #[error("array `{array}` holds {found} numbers, expected {expected} (candidates x steps)")]
    Length {
        /// Which array.
        array: &'static str,
        /// Its length.
        found: usize,
        /// count * steps.
        expected: usize,
    },
    /// A number is NaN or infinite.
    #[error("array `{array}` holds a number that is not finite at index {index}")]
    NotFinite {
        /// Which array.
        array: &'static str,
        /// Where.
        index: usize,
    },
    /// `dt` is not positive or there are no steps.
    #[error("time step must be positive and there must be at least one step")]
    Shape,
}

/// `count` trajectories of exactly `steps` states each; state k (from 0) is at time `(k + 1) * dt` after
/// the scene's stamp. Every array is `[candidate, step]`, row-major, map frame, finite.
///
/// Private fields, so a set can only hold what [`CandidateSet::new`] has checked.
#[derive(Debug, Clone, PartialEq)]
pub struct CandidateSet {
    steps: usize,
    dt: f64,
    id: Vec<u32>,
    x: Vec<f64>,
    y: Vec<f64>,
    heading: Vec<f64>,
    v: Vec<f64>,
    omega: Vec<f64>,
}

impl CandidateSet {
    /// Checks shapes and finiteness once, for good.
    #[expect(clippy::too_many_arguments, reason = "one argument an array; a struct would repeat the type")]
    pub fn new(
        steps: usize,
        dt: f64,
        id: Vec<u32>,
        x: Vec<f64>,
        y: Vec<f64>,
        heading: Vec<f64>,
        v: Vec<f64>,
        omega: Vec<f64>,
    ) -> Result<Self, CandidateError> {
        if steps == 0 || !(dt > 0.0 && dt.is_finite()) {
            return Err(CandidateError::Shape);
        }
        let expected = id.len() * steps;
        for (array, values) in [("x", &x), ("y", &y), ("heading", &heading), ("v", &v), ("omega", &omega)] {
            if values.len() != expected {
                return Err(CandidateError::Length { array, found: values.len(), expected });
            }
            if let Some(index) = values.iter().position(|n| !n.is_finite()) {
                return Err(CandidateError::NotFinite { array, index });
            }
        }
        Ok(Self { steps, dt, id, x, y, heading, v, omega })
    }

    /// No candidates of `steps` states.
    pub fn empty(steps: usize, dt: f64) -> Self {
        Self {
            steps,
            dt,
            id: Vec::new(),
            x: Vec::new(),
            y: Vec::new(),
            heading: Vec::new(),
            v: Vec::new(),
            omega: Vec::new(),
        }
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

    /// Identifiers, one a candidate; ties between equal costs go to the lower one.
    pub fn id(&self) -> &[u32] {
        &self.id
    }

    /// All x, `[candidate, step]`, metres.
    pub fn x(&self) -> &[f64] {
        &self.x
    }

    /// All y, `[candidate, step]`, metres.
    pub fn y(&self) -> &[f64] {
        &self.y
    }

    /// All headings, `[candidate, step]`, radians.
    pub fn heading(&self) -> &[f64] {
        &self.heading
    }

    /// All speeds, `[candidate, step]`, m/s: the twist that led to the state.
    pub fn v(&self) -> &[f64] {
        &self.v
    }

    /// All turn rates, `[candidate, step]`, rad/s.
    pub fn omega(&self) -> &[f64] {
        &self.omega
    }

    /// Where candidate `i` lies in each array.
    pub fn range(&self, i: usize) -> std::ops::Range<usize> {
        i * self.steps..(i + 1) * self.steps
    }

    /// The candidates with these indices, in this order.
    pub fn pick(&self, indices: &[usize]) -> Self {
        let states = |array: &[f64]| -> Vec<f64> {
            indices.iter().flat_map(|&i| array[self.range(i)].iter().copied()).collect()
        };
        Self {
            steps: self.steps,
            dt: self.dt,
            id: indices.iter().map(|&i| self.id[i]).collect(),
            x: states(&self.x),
            y: states(&self.y),
            heading: states(&self.heading),
            v: states(&self.v),
            omega: states(&self.omega),
        }
    }

    /// The candidates of all `sets`, numbered from 0 in order; the sets have `steps` and `dt` in common.
    pub fn concat(steps: usize, dt: f64, sets: &[Self]) -> Self {
        debug_assert!(sets.iter().all(|set| (set.steps, set.dt) == (steps, dt)));
        let all = |array: fn(&Self) -> &[f64]| sets.iter().flat_map(&array).copied().collect();
        let count = sets.iter().map(Self::len).sum::<usize>() as u32;
        Self {
            steps,
            dt,
            id: (0..count).collect(),
            x: all(Self::x),
            y: all(Self::y),
            heading: all(Self::heading),
            v: all(Self::v),
            omega: all(Self::omega),
        }
    }

    /// Candidates `range` alone: one shard.
    pub fn slice(&self, range: std::ops::Range<usize>) -> Self {
        let cells = range.start * self.steps..range.end * self.steps;
        Self {
            steps: self.steps,
            dt: self.dt,
            id: self.id[range].to_vec(),
            x: self.x[cells.clone()].to_vec(),
            y: self.y[cells.clone()].to_vec(),
            heading: self.heading[cells.clone()].to_vec(),
            v: self.v[cells.clone()].to_vec(),
            omega: self.omega[cells].to_vec(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picking_neighbours_is_slicing() {
        let n = |k: u32| (0..6).map(|i| f64::from(i * 10 + k)).collect::<Vec<f64>>();
        let set = CandidateSet::new(2, 0.3, vec![7, 8, 9], n(0), n(1), n(2), n(3), n(4)).unwrap();
        assert_eq!(set.pick(&[1, 2]), set.slice(1..3));
        assert_eq!(set.pick(&[2, 0]).id(), [9, 7]);
        let halves = [set.slice(0..1), set.slice(1..3)];
        let all = CandidateSet::concat(2, 0.3, &halves);
        assert_eq!((all.id(), all.x(), all.omega()), (&[0, 1, 2][..], set.x(), set.omega()));
        assert_eq!(set.pick(&[2, 0]).x(), [40.0, 50.0, 0.0, 10.0]);
    }

    #[test]
    fn shapes_and_numbers_are_checked() {
        let ok = |x: Vec<f64>| {
            CandidateSet::new(2, 0.3, vec![0], x, vec![0.0; 2], vec![0.0; 2], vec![0.0; 2], vec![0.0; 2])
        };
        assert!(ok(vec![0.0, 1.0]).is_ok());
        assert_eq!(ok(vec![0.0]), Err(CandidateError::Length { array: "x", found: 1, expected: 2 }));
        assert_eq!(ok(vec![0.0, f64::NAN]), Err(CandidateError::NotFinite { array: "x", index: 1 }));
    }
}
