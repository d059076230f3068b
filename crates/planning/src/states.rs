//! States of the robot over time, as a structure of arrays.

use std::ops::Range;

use crate::geometry::{Point2, Pose2, Twist};

/// What is wrong with arrays that should describe states.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[expect(missing_docs, reason = "the text of each error says what its fields are")]
pub enum StatesError {
    /// An array does not have one number per state.
    #[error("array `{array}` holds {found} numbers, expected {expected}, one per state")]
    Length { array: &'static str, found: usize, expected: usize },
    /// A number is NaN or infinite.
    #[error("array `{array}` holds a number that is not finite at index {index}")]
    NotFinite { array: &'static str, index: usize },
    /// `dt` is not positive or there are no steps.
    #[error("the time step must be positive and finite, and there must be at least one step")]
    Shape,
}

/// Which arrays of [`States`] hold something, besides `x` and `y`, which always do. The others are empty.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[expect(missing_docs, reason = "they are named as the arrays of the states")]
pub struct Columns {
    pub heading: bool,
    pub v: bool,
    pub omega: bool,
}

impl Columns {
    /// Positions alone.
    pub const POSITIONS: Self = Self { heading: false, v: false, omega: false };
    /// Positions and headings.
    pub const POSES: Self = Self { heading: true, ..Self::POSITIONS };
    /// Poses and twists.
    pub const ALL: Self = Self { heading: true, v: true, omega: true };
}

/// Poses in the map frame and the twists that led to them: one number per state in each array.
///
/// The fields are public, so nothing is guaranteed about them: [`crate::candidates::CandidateSet`] and
/// [`crate::trajectory::Trajectory`] check the arrays that they are made from.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct States {
    /// Metres.
    pub x: Vec<f64>,
    /// Metres.
    pub y: Vec<f64>,
    /// Radians.
    pub heading: Vec<f64>,
    /// Forward speed on the way to the state, m/s.
    pub v: Vec<f64>,
    /// Turn rate on the way to the state, rad/s.
    pub omega: Vec<f64>,
}

impl States {
    /// Number of states.
    pub fn len(&self) -> usize {
        self.x.len()
    }

    /// Whether there are no states.
    pub fn is_empty(&self) -> bool {
        self.x.is_empty()
    }

    /// Adds one state.
    pub fn push(&mut self, pose: Pose2, twist: Twist) {
        self.x.push(pose.x);
        self.y.push(pose.y);
        self.heading.push(pose.heading);
        self.v.push(twist.v);
        self.omega.push(twist.omega);
    }

    /// Adds so many states of zeros, which [`Self::set`] replaces.
    pub(crate) fn lengthen(&mut self, count: usize) {
        let Self { x, y, heading, v, omega } = self;
        for array in [x, y, heading, v, omega] {
            array.resize(array.len() + count, 0.0);
        }
    }

    /// Replaces state `k`.
    pub(crate) fn set(&mut self, k: usize, pose: Pose2, twist: Twist) {
        (self.x[k], self.y[k], self.heading[k]) = (pose.x, pose.y, pose.heading);
        (self.v[k], self.omega[k]) = (twist.v, twist.omega);
    }

    /// Adds the states of `other` behind these.
    pub fn append(&mut self, mut other: Self) {
        self.x.append(&mut other.x);
        self.y.append(&mut other.y);
        self.heading.append(&mut other.heading);
        self.v.append(&mut other.v);
        self.omega.append(&mut other.omega);
    }

    /// Adds some states of `other` behind these.
    pub fn extend_from(&mut self, other: &Self, range: Range<usize>) {
        self.x.extend_from_slice(&other.x[range.clone()]);
        self.y.extend_from_slice(&other.y[range.clone()]);
        self.heading.extend_from_slice(&other.heading[range.clone()]);
        self.v.extend_from_slice(&other.v[range.clone()]);
        self.omega.extend_from_slice(&other.omega[range]);
    }

    /// Position of state `k`, which must exist, as for the other methods.
    pub fn position(&self, k: usize) -> Point2 {
        Point2::new(self.x[k], self.y[k])
    }

    /// Pose of state `k`.
    pub fn pose(&self, k: usize) -> Pose2 {
        Pose2::new(self.x[k], self.y[k], self.heading[k])
    }

    /// Poses of some states.
    pub fn poses(&self, range: Range<usize>) -> impl ExactSizeIterator<Item = Pose2> {
        range.map(|k| self.pose(k))
    }

    /// Pose and twist of state `k`.
    pub fn at(&self, k: usize) -> (Pose2, Twist) {
        (self.pose(k), Twist { v: self.v[k], omega: self.omega[k] })
    }

    /// What `choose` makes of each array.
    pub(crate) fn map(&self, choose: impl Fn(&[f64]) -> Vec<f64>) -> Self {
        Self {
            x: choose(&self.x),
            y: choose(&self.y),
            heading: choose(&self.heading),
            v: choose(&self.v),
            omega: choose(&self.omega),
        }
    }

    /// Whether there are `expected` states, of which `columns` are known, and all their numbers are finite.
    pub(crate) fn check(&self, expected: usize, columns: Columns) -> Result<(), StatesError> {
        let Self { x, y, heading, v, omega } = self;
        let arrays = [
            ("x", x, true),
            ("y", y, true),
            ("heading", heading, columns.heading),
            ("v", v, columns.v),
            ("omega", omega, columns.omega),
        ];
        for (array, values, is_known) in arrays {
            let expected = if is_known { expected } else { 0 };
            if values.len() != expected {
                return Err(StatesError::Length { array, found: values.len(), expected });
            }
            // Without an early exit the loop runs several numbers at a time.
            if !values.iter().fold(true, |good, n| good & n.is_finite()) {
                let index = values.iter().position(|n| !n.is_finite()).unwrap_or(0);
                return Err(StatesError::NotFinite { array, index });
            }
        }
        Ok(())
    }
}
