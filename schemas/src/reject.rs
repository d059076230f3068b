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

/// What is wrong with a request, or with the service that cannot serve it now.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, VariantNames, IntoStaticStr)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Refusal {
    /// The bytes are more than the message may have.
    Oversize {
        /// Bytes received.
        found: u64,
        /// Bytes allowed.
        most: u64,
    },
    /// The encoding string is that of another message or of another version of the contract.
    WrongEncoding {
        /// The encoding received, cut to what a text may be.
        found: String,
        /// The encoding that the key takes.
        expected: String,
    },
    /// The bytes are not one CBOR item of definite length.
    Malformed {
        /// Where, in bytes from the start.
        offset: u64,
        /// What is wrong there.
        fault: CborFault,
    },
    /// The CBOR item lacks a field of the message, or a field has another type.
    WrongStructure {
        /// What the deserialiser says, for a person.
        detail: String,
    },
    /// A number is not finite, or larger in magnitude than anything physical.
    NotFinite,
    /// A number is not within its range.
    OutOfRange {
        /// The number.
        found: f64,
        /// The least that is allowed.
        least: f64,
        /// The most that is allowed.
        most: f64,
    },
    /// A number is not greater than zero.
    NotPositive {
        /// The number.
        found: f64,
    },
    /// A list or array has another length than its shape says.
    WrongLength {
        /// Its length.
        found: u64,
        /// What its shape says.
        expected: u64,
    },
    /// A list, array or text is longer than it may be.
    TooMany {
        /// Its length.
        found: u64,
        /// The most that is allowed.
        most: u64,
    },
    /// A list, array or text is shorter than it must be.
    TooFew {
        /// Its length.
        found: u64,
        /// The least that is allowed.
        least: u64,
    },
    /// A text cannot be a name: 1 to 64 of `a-z 0-9 _ -`.
    NotAName {
        /// The text, cut to what a name may be.
        found: String,
    },
    /// A name stands for nothing that this service knows.
    UnknownName {
        /// The name.
        found: String,
        /// The names it knows.
        known: Vec<String>,
    },
    /// An index points to nothing.
    NoSuchIndex {
        /// The index.
        found: u64,
    },
    /// The parents of a tree's nodes form a cycle.
    CyclicParents,
    /// The numbers of a list do not rise.
    NotAscending,
    /// People are given in a frame that this message does not take.
    WrongFrame,
    /// A value of free form is not a map with text keys.
    NotAMap,
    /// A file's name is not a relative path of plain names.
    UnsafePath {
        /// The name, cut.
        found: String,
    },
    /// A text is not 64 lower-case hexadecimal digits.
    NotAHash,
    /// The key is asked without a payload.
    UnexpectedPayload,
    /// The robot named in the question's key is not a plain name, or is another than the service's.
    WrongRobot,
    /// The goal cannot be reached from the start.
    UnreachableGoal {
        /// m, map frame.
        x: f64,
        /// m, map frame.
        y: f64,
    },
    /// What was served as this map has another content.
    WrongMap,
    /// A file that the scenario names was not sent with it.
    MissingFile {
        /// Its name.
        found: String,
    },
    /// A parameter or file has a value that it may not have.
    Invalid {
        /// What is wrong and what would be right, for a person.
        detail: String,
    },
    /// A decision's epoch lies too far above that of the last one obeyed.
    EpochOutOfReach,
    /// The robot has no mission.
    NoMission,
    /// The driver has taken no decision yet.
    NoDecision,
    /// The mission is in another state than the request needs.
    WrongState {
        /// The state it is in.
        found: MissionState,
        /// The state that is needed.
        needed: MissionState,
    },
    /// The mission is finished, so it cannot be cancelled.
    AlreadyFinished,
    /// The request is about another revision than the current one.
    StaleRevision {
        /// The revision it is about.
        found: u64,
        /// The current one.
        current: u64,
    },
    /// The localizer was restarted in mid-run, so it does not know where the robot is.
    PoseLost,
    /// A run is under way in this world.
    Busy,
    /// Every slot is busy and the queue is full: another instance may serve it.
    Overloaded,
    /// The budget was over before the work was done, or the service is shutting down.
    Stopped,
    /// The service has not derived what the request needs; a request without work makes it do so.
    Cold {
        /// What is not there, for a person.
        detail: String,
    },
    /// The map could not be fetched.
    NoMap {
        /// Why, for a person.
        detail: String,
    },
    /// No replica of the term gets ready.
    NoReplica {
        /// Which term.
        term: String,
        /// Whether one may still come by itself.
        may_come: bool,
        /// What a replica answered, for a person; empty if none answered.
        detail: String,
    },
    /// The service failed while it worked on the request.
    Failed {
        /// What happened, for a person.
        detail: String,
    },
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

    /// A value that a check of its own refuses; `detail` is what that check says, cut to [`MAX_TEXT`].
    pub fn invalid(detail: impl ToString) -> Self {
        Self::Invalid { detail: cut(detail.to_string()) }
    }

    /// No replica of `term` gets ready; `detail` is cut to [`MAX_TEXT`].
    pub fn no_replica(term: &str, may_come: bool, detail: String) -> Self {
        Self::NoReplica { term: term.to_owned(), may_come, detail: cut(detail) }
    }

    /// A failure inside the service; `detail` is cut to [`MAX_TEXT`].
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
