//! Why something happened, as a code with its parameters. [`crate::words`] makes a sentence of it where a person reads.
//!
//! On the wire a reason is a map whose key `code` says which parameters the other keys hold. Programs match the code and
//! never a sentence.

use crate::check;
use crate::message::Validate;
use crate::mission_state::MissionState;
use crate::reject::Reject;
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantNames};

/// Why a candidate was not taken, other than for its cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, VariantNames, IntoStaticStr)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Rejection {
    /// An active term has no score for it.
    NotScored {
        /// The first such term.
        term: String,
    },
    /// It leaps farther than the robot can drive in one step.
    Unreachable {
        /// Index of the state that it leaps to.
        step: u32,
    },
    /// It runs into a wall.
    HitsWall {
        /// Seconds after the scene's stamp.
        after_s: f64,
    },
    /// It runs into a person.
    HitsPerson {
        /// The person's id.
        person: u32,
        /// Seconds after the scene's stamp.
        after_s: f64,
    },
    /// It is slow, and a faster candidate is free.
    Slow,
}

impl Validate for Rejection {
    fn validate(&self) -> Result<(), Reject> {
        match self {
            Self::NotScored { term } => check::id("term", term),
            Self::HitsWall { after_s } | Self::HitsPerson { after_s, .. } => {
                check::non_negative(&[("after_s", *after_s)])
            }
            Self::Unreachable { .. } | Self::Slow => Ok(()),
        }
    }
}

/// What came of the previous trajectory when no candidate could be followed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, VariantNames)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum PreviousState {
    /// Its tail is valid and free, so the robot follows it.
    Held,
    /// There is none.
    Absent,
    /// It is no longer valid.
    Expired,
    /// The robot is too far from it.
    Strayed {
        /// Metres.
        distance_m: f64,
    },
    /// It runs into a wall.
    HitsWall {
        /// Seconds after the scene's stamp.
        after_s: f64,
    },
    /// It runs into a person.
    HitsPerson {
        /// The person's id.
        person: u32,
        /// Seconds after the scene's stamp.
        after_s: f64,
    },
}

impl Validate for PreviousState {
    fn validate(&self) -> Result<(), Reject> {
        match *self {
            Self::Held | Self::Absent | Self::Expired => Ok(()),
            Self::Strayed { distance_m } => check::non_negative(&[("distance_m", distance_m)]),
            Self::HitsWall { after_s } | Self::HitsPerson { after_s, .. } => {
                check::non_negative(&[("after_s", after_s)])
            }
        }
    }
}

/// Why the arbiter decided as it did.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, VariantNames, IntoStaticStr)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Reason {
    /// The believed position is at the goal.
    Arrived,
    /// The candidate of least cost is free.
    LeastCost,
    /// Only slow candidates are free; the one of least cost is followed.
    OnlySlowFree,
    /// There are no candidates.
    NoCandidates {
        /// What came of the previous trajectory.
        previous: PreviousState,
    },
    /// No candidate is scored by every active term.
    NotScored {
        /// The first term that is missing.
        term: String,
        /// What came of the previous trajectory.
        previous: PreviousState,
    },
    /// Every scored candidate is unreachable or collides.
    NoneFree {
        /// What came of the previous trajectory.
        previous: PreviousState,
    },
    /// The mission is not running.
    MissionNotRunning {
        /// Where it stands.
        state: MissionState,
    },
    /// The arbiter is not prepared for the mission.
    NotPrepared,
    /// No recent message says where people are.
    PeopleUnknown,
    /// The arbiter could not carry out the cycle; its log says why.
    CycleFailed,
}

impl Validate for Reason {
    fn validate(&self) -> Result<(), Reject> {
        match self {
            Self::NotScored { term, previous } => {
                check::id("term", term)?;
                check::part("previous", previous)
            }
            Self::NoCandidates { previous } | Self::NoneFree { previous } => {
                check::part("previous", previous)
            }
            _ => Ok(()),
        }
    }
}

/// What was not as it should be in a cycle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, VariantNames, IntoStaticStr)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Degradation {
    /// No replica has scored the term; the arbiter did.
    EvaluatedLocally {
        /// Which term.
        term: String,
    },
    /// Some candidates have no score under the term.
    PartlyEvaluated {
        /// Which term.
        term: String,
    },
    /// No candidate has a score under the term.
    NotEvaluated {
        /// Which term.
        term: String,
    },
    /// No generator answered for some tree; the arbiter grew it.
    GeneratedLocally,
    /// Some trees were not grown.
    PartlyGenerated,
    /// No tree was grown.
    NotGenerated,
    /// The budget ended the growth of a tree.
    CutShort,
    /// The arbiter is not prepared for the mission.
    NotPrepared,
    /// No recent message says where people are.
    PeopleUnknown,
    /// The arbiter could not carry out the cycle.
    CycleFailed,
}

impl Degradation {
    /// Its code as it stands on the wire.
    pub fn code(&self) -> &'static str {
        self.into()
    }
}

impl Validate for Degradation {
    fn validate(&self) -> Result<(), Reject> {
        match self {
            Self::EvaluatedLocally { term }
            | Self::PartlyEvaluated { term }
            | Self::NotEvaluated { term } => check::id("term", term),
            _ => Ok(()),
        }
    }
}

/// What the driver does with the newest decision, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, VariantNames, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum CommandReason {
    /// It follows the decision's trajectory.
    Tracking,
    /// It follows the decision as far as what the laser sees close by allows: it brakes.
    TooClose,
    /// It stops: the arbiter believes to be at the goal.
    Arrived,
    /// It stops, as decided.
    ToldToStop,
    /// It stops: the mission is not running.
    MissionNotRunning,
    /// It stops: odometry has not come for several ticks.
    NoOdometry,
    /// It stops: no decision has come.
    NoDecision,
    /// It stops: the decision is no longer valid.
    DecisionExpired,
    /// It stops: the decision's stamp lies ahead of the robot's clock, so it is of another run.
    DecisionOfAnotherRun,
    /// It stops: the decision's states are not a trajectory.
    DecisionInvalid,
    /// It stops: the belief that the decision was made from is no longer remembered.
    DecisionBeliefUnknown,
    /// It stops: no belief has come.
    NoBelief,
    /// It stops: the newest belief is too old.
    BeliefTooOld,
    /// It stops: the belief's stamp lies ahead of the robot's clock.
    BeliefOfAnotherRun,
    /// It stops: no scan has come.
    NoScan,
    /// It stops: the newest scan is too old.
    ScanTooOld,
    /// It stops: the scan's stamp lies ahead of the robot's clock.
    ScanOfAnotherRun,
}

impl CommandReason {
    /// Its code as it stands on the wire.
    pub fn code(self) -> &'static str {
        self.into()
    }

    /// Whether a command given for this reason follows a decision.
    pub fn follows(self) -> bool {
        matches!(self, Self::Tracking | Self::TooClose)
    }
}

/// Why a mission ended, or cannot begin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, VariantNames)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum MissionEnd {
    /// The robot is at the goal.
    Reached,
    /// The time limit is over.
    Timeout,
    /// The robot believes to be at the goal and is not.
    Lost,
    /// A client asked for it.
    Cancelled,
    /// A required role cannot prepare for it.
    Unprepared {
        /// Which role.
        role: String,
        /// Which instance of it.
        instance: String,
        /// Why.
        reject: Reject,
    },
    /// The world that the robot drives in failed.
    WorldFailed {
        /// Why.
        reject: Reject,
    },
}

impl Validate for MissionEnd {
    fn validate(&self) -> Result<(), Reject> {
        match self {
            Self::Unprepared { role, instance, reject } => {
                check::id("role", role)?;
                check::id("instance", instance)?;
                check::part("reject", reject)
            }
            Self::WorldFailed { reject } => check::part("reject", reject),
            _ => Ok(()),
        }
    }
}
