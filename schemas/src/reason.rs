//! Why something happened, as a code with its parameters. [`crate::words`] makes a sentence of it where a person reads.
//!
//! On the wire a reason is a map whose key `code` says which parameters the other keys hold. Programs match the code
//! and never a sentence. No parameter is a typed array: serde reads an enum that a key tells apart (`code`) through a
//! buffer, which cannot hold CBOR tags.

use crate::check::{checks, id, non_negative, part};
use crate::{MissionState, Reject};
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantNames};

/// Why a candidate was not taken, other than for its cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, VariantNames, IntoStaticStr)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
#[expect(missing_docs, reason = "the text of each code says what its parameters are")]
pub enum Rejection {
    /// It has no score of an active term; this is the first such term.
    NotScored { term: String },
    /// It leaps farther than the robot can drive in one step, to the state of this index.
    Unreachable { step: u32 },
    /// It runs into a wall so many seconds after the scene's stamp.
    HitsWall { after_s: f64 },
    /// It runs into the person of this id so many seconds after the scene's stamp.
    HitsPerson { person: u32, after_s: f64 },
    /// It is slow, and a faster candidate is free.
    Slow,
}

checks! { Rejection {
    NotScored { term: id }
    HitsWall { after_s: non_negative }
    HitsPerson { after_s: non_negative }
}}

/// What came of the previous trajectory when no candidate could be followed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, VariantNames)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
#[expect(missing_docs, reason = "the text of each code says what its parameters are")]
pub enum PreviousState {
    /// Its tail is valid and free, so the robot follows it.
    Held,
    /// There is none.
    Absent,
    /// It is no longer valid.
    Expired,
    /// The robot is so many metres from it, which is too far.
    Strayed { distance_m: f64 },
    /// It runs into a wall so many seconds after the scene's stamp.
    HitsWall { after_s: f64 },
    /// It runs into the person of this id so many seconds after the scene's stamp.
    HitsPerson { person: u32, after_s: f64 },
}

checks! { PreviousState {
    Strayed { distance_m: non_negative }
    HitsWall { after_s: non_negative }
    HitsPerson { after_s: non_negative }
}}

/// Why the arbiter decided as it did.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, VariantNames, IntoStaticStr)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
#[expect(missing_docs, reason = "the text of each code says what its parameters are")]
pub enum Reason {
    /// The believed position is at the goal.
    Arrived,
    /// It is, and the robot turns on the spot to the heading that is asked for there.
    TurnsToHeading,
    /// People stand at the goal and leave the robot no room there: it waits at a polite distance.
    WaitsForGoal,
    /// The candidate of least cost is free.
    LeastCost,
    /// Candidates that cost less collide; the one of least cost among the free ones is followed.
    LeastCostFree,
    /// Only slow candidates are free; the one of least cost is followed.
    OnlySlowFree,
    /// There are no candidates.
    NoCandidates { previous: PreviousState },
    /// No candidate is scored by every active term; `term` is the first that is missing.
    NotScored { term: String, previous: PreviousState },
    /// Every scored candidate is unreachable or collides.
    NoneFree { previous: PreviousState },
    /// The mission stands where it is not running.
    MissionNotRunning { state: MissionState },
    /// The arbiter is not prepared for the mission.
    NotPrepared,
    /// No recent message says where people are.
    PeopleUnknown,
    /// Obstacles that are on no map have closed every way to the goal for 25 s.
    NoWayToGoal,
    /// The robot has waited for 30 s for people who stand at its goal.
    GoalOccupied,
    /// The robot does not know where it is, so it looks around and drives along walls.
    Localises,
    /// The robot has not known for 30 s where it is.
    PlaceUnknown,
}

impl Reason {
    /// Its code as it stands on the wire.
    pub fn code(&self) -> &'static str {
        self.into()
    }
}

checks! { Reason {
    NotScored { term: id, previous: part }
    NoCandidates { previous: part }
    NoneFree { previous: part }
}}

/// What was not as it should be in a cycle.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, VariantNames, IntoStaticStr)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
#[expect(missing_docs, reason = "the text of each code says what its parameters are")]
pub enum Degradation {
    /// No replica has scored the term; the arbiter did.
    EvaluatedLocally { term: String },
    /// Some candidates have no score under the term.
    PartlyEvaluated { term: String },
    /// No candidate has a score under the term.
    NotEvaluated { term: String },
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
}

impl Degradation {
    /// Its code as it stands on the wire.
    pub fn code(&self) -> &'static str {
        self.into()
    }
}

checks! { Degradation {
    EvaluatedLocally { term: id }
    PartlyEvaluated { term: id }
    NotEvaluated { term: id }
}}

/// What the driver does with the newest decision, and why.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, VariantNames, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum CommandReason {
    /// It follows the decision's trajectory.
    Tracking,
    /// It follows the decision more slowly: it could not brake in time for what the laser sees, or something moves
    /// close by.
    Slowed,
    /// It follows the decision more slowly: the belief is doubtful.
    InDoubt,
    /// It follows the decision as far as what the laser sees close by allows: it brakes, or stands.
    TooClose,
    /// It follows the decision as fast as lets it stop within what the laser has seen in the last second: it brakes.
    WayUnseen,
    /// It stops: the arbiter believes that the robot is at the goal.
    Arrived,
    /// It stops, as decided.
    ToldToStop,
    /// It stops: the mission is not running.
    MissionNotRunning,
    /// It stops: odometry has not come for several ticks.
    NoOdometry,
    /// It stops: the robot is paused.
    Paused,
    /// It stops: the base has not let this driver drive, or does not any more.
    NoLease,
    /// It stops: the base's clock jumps, crawls or stands, so that no age can be told.
    BaseClockWrong,
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
    /// It stops: the robot does not know where it is, and the decision takes it for known.
    Lost,
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
    /// It stops: the newest scans are refused, because they contradict themselves.
    BlindRefused,
    /// It stops: the scan looks over a smaller angle than the robot's file declares.
    BlindNarrow,
    /// It stops: the scanner reaches less far than the robot's file declares.
    BlindShort,
    /// It stops: fewer of the scan's beams say anything than the robot's file declares.
    BlindSilent,
    /// It stops: scans come less often than the robot's file declares.
    BlindRare,
    /// It stops: the scan shows free floor where the map has walls well within its range.
    BlindMap,
}

impl CommandReason {
    /// Its code as it stands on the wire.
    pub fn code(self) -> &'static str {
        self.into()
    }

    /// Whether a command given for this reason follows a decision.
    pub fn follows(self) -> bool {
        matches!(self, Self::Tracking | Self::Slowed | Self::InDoubt | Self::TooClose | Self::WayUnseen)
    }

    /// Whether it stops because the laser sees too little.
    pub fn is_blind(self) -> bool {
        matches!(
            self,
            Self::BlindRefused
                | Self::BlindNarrow
                | Self::BlindShort
                | Self::BlindSilent
                | Self::BlindRare
                | Self::BlindMap
        )
    }
}

/// Why a mission ended, or cannot begin.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, VariantNames)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
#[expect(missing_docs, reason = "the text of each code says what its parameters are")]
pub enum MissionEnd {
    /// The robot is at the goal.
    Reached,
    /// The time limit is over.
    Timeout,
    /// The robot does not know where it is, or is not at the goal where it believes itself.
    Lost,
    /// Obstacles that are on no map close every way to the goal.
    NoWayToGoal,
    /// People stand at the goal.
    GoalOccupied,
    /// A client asked for it.
    Cancelled,
    /// This instance of a required role cannot prepare for it.
    Unprepared { role: String, instance: String, reject: Reject },
    /// The world that the robot drives in failed.
    WorldFailed { reject: Reject },
}

checks! { MissionEnd {
    Unprepared { role: id, instance: id, reject: part }
    WorldFailed { reject: part }
}}
