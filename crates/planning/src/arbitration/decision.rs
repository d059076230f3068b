//! What a cycle ends in, and why.

use crate::collision::Collision;
use crate::trajectory::Trajectory;

/// What the robot is to do.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Action {
    /// Drive the trajectory, which every active term has scored.
    Follow,
    /// Drive on along the tail of the previous trajectory.
    Hold,
    /// Brake and stand.
    Stop,
}

/// How a cycle ends; never without one.
#[derive(Debug, Clone, PartialEq)]
pub struct Decision {
    /// What to do.
    pub action: Action,
    /// Why.
    pub reason: Reason,
    /// Id of the candidate followed; when holding, that of the cycle it comes from.
    pub candidate: Option<u32>,
    /// What to drive, timed from this cycle's stamp; without states when stopping.
    pub trajectory: Trajectory,
    /// Seconds after this cycle's stamp for which the decision holds; zero when stopping.
    pub valid_for: f64,
    /// Whether the goal is reached.
    pub arrived: bool,
}

impl Decision {
    /// Brake and stand, for `reason`.
    pub fn stop(reason: Reason, dt: f64) -> Self {
        let arrived = reason == Reason::Arrived;
        let trajectory = Trajectory::none(dt);
        Self { action: Action::Stop, reason, candidate: None, trajectory, valid_for: 0.0, arrived }
    }

    /// Whether the robot is where it was to go, if perhaps not with the heading that is asked for.
    pub(super) fn is_at_goal(&self) -> bool {
        matches!(self.reason, Reason::Arrived | Reason::TurnsToHeading)
    }
}

/// Why the action was chosen.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the text of each variant says what its fields are")]
pub enum Reason {
    /// The estimated position is at the goal.
    Arrived,
    /// It is, and the robot turns to the heading that is asked for there.
    TurnsToHeading,
    /// People stand at the goal and leave the robot no room there: it waits at a polite distance.
    WaitsForGoal,
    /// The candidate of least cost is free.
    LeastCost,
    /// Candidates that cost less collide; this is the one of least cost among the free ones.
    LeastCostFree,
    /// Only slow candidates are free; this is the one of least cost (D4).
    OnlySlowFree,
    /// Nothing could be followed: what was lacking, and what came of the previous trajectory, held or why not.
    Degraded { lack: Lack, previous: PreviousState },
}

/// Why nothing could be followed.
#[derive(Debug, Clone, PartialEq, Eq)]
#[expect(missing_docs, reason = "the text of each variant says what its fields are")]
pub enum Lack {
    /// The generator gave no candidates.
    NoCandidates,
    /// No candidate has a score of every term; this is the first that is missing.
    NotScored { term: String },
    /// Candidates were scored but each is unreachable or collides.
    NoneFree,
}

/// What came of the previous trajectory when there was nothing to follow.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(missing_docs, reason = "the text of each variant says what its fields are")]
pub enum PreviousState {
    /// Valid and free: its tail is held.
    Held,
    /// There is none.
    Absent,
    /// Its validity has run out.
    Expired,
    /// The robot is so far from it, which is too far.
    Strayed { metres: f64 },
    /// It would now run into something.
    Collides(Collision),
}

/// Why a candidate was not taken, other than for its cost.
#[derive(Debug, Clone, PartialEq)]
#[expect(missing_docs, reason = "the text of each variant says what its fields are")]
pub enum Rejection {
    /// An active term has no usable score for it; this is the first such term.
    NotScored { term: String },
    /// It leaps farther than the robot can drive, to the state of this index (Alg. 2, line 4).
    Unreachable { step: usize },
    /// It runs into something.
    Collides(Collision),
    /// It is slow and a faster one is free (D4).
    Slow,
}

/// The last decision that moved the robot, as far as the next cycle needs it.
#[derive(Debug, Clone, PartialEq)]
pub struct Previous {
    /// What was to be driven, timed from `stamp`.
    pub trajectory: Trajectory,
    /// Its candidate's id.
    pub candidate: Option<u32>,
    /// Stamp of its scene, robot's clock, seconds.
    pub stamp: f64,
    /// Seconds after `stamp` for which it is valid.
    pub valid_for: f64,
}

impl Previous {
    /// `decision`, made for the scene at `stamp`, as the next cycle's previous one; nothing if it
    /// stopped the robot. A held tail will do: its validity has shrunk accordingly.
    pub fn of(decision: &Decision, stamp: f64) -> Option<Self> {
        (!decision.trajectory.is_empty()).then(|| Self {
            trajectory: decision.trajectory.clone(),
            candidate: decision.candidate,
            stamp,
            valid_for: decision.valid_for,
        })
    }
}
