//! The answer to a request that could not be served, and what a check says about a bad field.

use crate::limits::MAX_TEXT;
use crate::mission_state::MissionState;
use crate::words;
use serde::{Deserialize, Serialize};
use strum::{IntoStaticStr, VariantNames};

/// Why a request was refused (the payload of an error reply), or why a message is not valid.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, thiserror::Error)]
#[error("{}{}", .field.as_ref().map(|field| format!("{field}: ")).unwrap_or_default(), words::say("refusal", .why))]
pub struct Reject {
    /// The field at fault, as a path such as `scene.people.x`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field: Option<String>,
    /// What is wrong.
    pub why: Refusal,
}

/// Why bytes are not one CBOR item of definite length.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, VariantNames)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum CborFault {
    /// Bytes follow the end of the item.
    TrailingBytes,
    /// It has more data items than a message may have.
    TooManyItems,
    /// It is nested too deeply.
    TooDeep,
    /// It ends too early, or declares more than it holds.
    CutShort,
    /// A length is indefinite.
    IndefiniteLength,
    /// The additional information of an item is reserved.
    ReservedInformation,
    /// A simple value is not assigned.
    UnassignedSimple,
}

/// What is wrong with a request, or with the service that cannot serve it now. `found` is what was received; `detail`
/// is free text for a person, cut to [`MAX_TEXT`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, VariantNames, IntoStaticStr)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
#[expect(missing_docs, reason = "the text of each code says what its parameters are")]
pub enum Refusal {
    /// The bytes are more than the message may have.
    Oversize { found: u64, most: u64 },
    /// The encoding string (cut) is that of another message or of another version of the contract.
    WrongEncoding { found: String, expected: String },
    /// The bytes are not one CBOR item of definite length: what is wrong, so many bytes from the start.
    Malformed { offset: u64, fault: CborFault },
    /// The CBOR item lacks a field of the message, or a field has another type.
    WrongStructure { detail: String },
    /// A number is not finite, or larger in magnitude than anything physical.
    NotFinite,
    /// A number is not within its range.
    OutOfRange { found: f64, least: f64, most: f64 },
    /// A number is not greater than zero.
    NotPositive { found: f64 },
    /// A list or array has another length than its shape says.
    WrongLength { found: u64, expected: u64 },
    /// A list, array or text is longer than it may be.
    TooMany { found: u64, most: u64 },
    /// A list, array or text is shorter than it must be.
    TooFew { found: u64, least: u64 },
    /// A text (cut to what a name may be) cannot be a name: 1 to 64 of `a-z 0-9 _ -`.
    NotAName { found: String },
    /// A name stands for nothing that this service knows; these it knows.
    UnknownName { found: String, known: Vec<String> },
    /// An index points to nothing.
    NoSuchIndex { found: u64 },
    /// The parents of a tree's nodes form a cycle.
    CyclicParents,
    /// The numbers of a list do not rise.
    NotAscending,
    /// People are given in a frame that this message does not take.
    WrongFrame,
    /// A value of free form is not a map with text keys.
    NotAMap,
    /// A file's name (cut) is not a relative path of plain names.
    UnsafePath { found: String },
    /// A text is not 64 lower-case hexadecimal digits.
    NotAHash,
    /// The key is asked without a payload.
    UnexpectedPayload,
    /// The last chunk of a question's key is not a plain name, so it is not the name of the robot that asks.
    WrongRobot,
    /// The last chunk of a command's key is not the name of who commands.
    WrongCommander,
    /// The goal, m in the map frame, cannot be reached from the start.
    UnreachableGoal { x: f64, y: f64 },
    /// Nowhere within the goal's tolerance there is room for the robot on its map: the most room that there is, m, is
    /// less than the robot's radius, m.
    NoRoomAtGoal { x: f64, y: f64, room: f64, radius: f64 },
    /// What was served as this map has another content.
    WrongMap,
    /// A parameter or file has a value that it may not have: what is wrong and what would be right.
    Invalid { detail: String },
    /// A mission asks for more than the robot's own limits allow.
    BeyondRobot { found: f64, least: f64, most: f64 },
    /// The base is a real one: the mission must be in real time.
    RealtimeOnly,
    /// Another driver, of this instance, holds the robot's lease.
    LeaseHeld { holder: String },
    /// The base has not let this driver drive, or does not any more.
    NoLease,
    /// The robot has no mission.
    NoMission,
    /// The driver has taken no decision yet.
    NoDecision,
    /// The mission is in another state than the request needs.
    WrongState { found: MissionState, needed: MissionState },
    /// The mission is finished, so it cannot be cancelled.
    AlreadyFinished,
    /// The request is about another revision than the current one.
    StaleRevision { found: u64, current: u64 },
    /// The localizer was restarted in mid-run, so it does not know where the robot is.
    PoseLost,
    /// A run is under way in this world.
    Busy,
    /// Every slot is busy and the queue is full: another instance may serve it.
    Overloaded,
    /// The budget was over before the work was done, or the service is shutting down.
    Stopped,
    /// The service has not derived what the request needs; a request without work makes it do so.
    Cold { detail: String },
    /// The map could not be fetched.
    NoMap { detail: String },
    /// No replica of the term gets ready: what the last one asked has answered, or that none has. `may_come` says
    /// whether one may still get ready by itself.
    NoReplica { term: String, may_come: bool, detail: String },
    /// The service failed while it worked on the request.
    Failed { detail: String },
    /// A code that this version does not know.
    #[serde(other)]
    Unknown,
}

impl Refusal {
    /// Every code as it stands on the wire.
    pub const CODES: &[&str] = Self::VARIANTS;

    /// Its code as it stands on the wire.
    pub fn code(&self) -> &'static str {
        self.into()
    }

    /// Whether the same request may be granted later without a change of the request.
    pub fn is_transient(&self) -> bool {
        matches!(
            self,
            Self::Overloaded
                | Self::Busy
                | Self::NoLease
                | Self::Stopped
                | Self::Cold { .. }
                | Self::NoMap { .. }
                | Self::NoReplica { may_come: true, .. }
        )
    }

    /// This refusal of the field `field`.
    pub fn at(self, field: impl Into<String>) -> Reject {
        Reject { field: Some(cut(field.into())), why: self }
    }

    /// A value that a check of its own refuses; `detail` is what that check says.
    pub fn invalid(detail: impl ToString) -> Self {
        Self::Invalid { detail: cut(detail.to_string()) }
    }

    /// No replica of `term` gets ready.
    pub fn no_replica(term: &str, may_come: bool, detail: String) -> Self {
        Self::NoReplica { term: term.to_owned(), may_come, detail: cut(detail) }
    }

    /// A failure inside the service.
    pub fn failed(detail: impl ToString) -> Self {
        Self::Failed { detail: cut(detail.to_string()) }
    }
}

impl From<Refusal> for Reject {
    fn from(why: Refusal) -> Self {
        Self { field: None, why }
    }
}

impl Reject {
    /// The same refusal seen from the message that holds the one at fault as `parent`.
    #[must_use]
    pub fn within(mut self, parent: &str) -> Self {
        self.field = Some(match self.field {
            Some(field) => cut(format!("{parent}.{field}")),
            None => parent.to_owned(),
        });
        self
    }
}

/// `text` cut to [`MAX_TEXT`] bytes on a character boundary.
pub(crate) fn cut(mut text: String) -> String {
    text.truncate(text.floor_char_boundary(MAX_TEXT));
    text
}
