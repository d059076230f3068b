//! The answer to a request that could not be served, and what a check says about a bad field.

use crate::check;
use crate::limits::MAX_TEXT;
use crate::message::{DecodeError, Validate};
use serde::{Deserialize, Serialize};

/// What kind of refusal it is, for programs.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RejectCode {
    /// Not CBOR, or not this message.
    Malformed,
    /// Larger than the message may be.
    Oversize,
    /// Another message or another version of the contract.
    Version,
    /// A field has a value, shape or size it may not have.
    Invalid,
    /// The service has too much to do; ask another instance.
    Overloaded,
    /// The service is shutting down, or the budget had run out.
    Stopped,
    /// The service has not prepared this map yet; it takes no work until it has.
    Cold,
    /// Anything else, and any code this version does not know.
    #[serde(other)]
    Unknown,
}

impl RejectCode {
    /// All of them.
    pub const ALL: [Self; 8] = [
        Self::Malformed,
        Self::Oversize,
        Self::Version,
        Self::Invalid,
        Self::Overloaded,
        Self::Stopped,
        Self::Cold,
        Self::Unknown,
    ];

    /// As it stands on the wire.
    pub fn name(self) -> &'static str {
        match self {
            Self::Malformed => "malformed",
            Self::Oversize => "oversize",
            Self::Version => "version",
            Self::Invalid => "invalid",
            Self::Overloaded => "overloaded",
            Self::Stopped => "stopped",
            Self::Cold => "cold",
            Self::Unknown => "unknown",
        }
    }

    /// Whether the same request may be granted later, without anybody mending it.
    pub fn is_transient(self) -> bool {
        matches!(self, Self::Overloaded | Self::Stopped | Self::Cold)
    }
}

/// Why a request was refused (the payload of an error reply) or why a message is not valid.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{}{reason}", .field.as_ref().map(|field| format!("{field}: ")).unwrap_or_default())]
pub struct Reject {
    /// For a person: what is wrong and what would be right.
    pub reason: String,
    /// The field at fault, as a path such as `scene.people.x`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub field: Option<String>,
    /// For a program.
    pub code: RejectCode,
}

impl Reject {
    /// A refusal that concerns no field. `reason` is cut to [`MAX_TEXT`].
    pub fn new(code: RejectCode, reason: impl Into<String>) -> Self {
        Self { reason: cut(reason.into()), field: None, code }
    }

    /// A field with a value it may not have.
    pub fn invalid(field: impl Into<String>, reason: impl Into<String>) -> Self {
        Self { reason: cut(reason.into()), field: Some(cut(field.into())), code: RejectCode::Invalid }
    }

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
fn cut(mut text: String) -> String {
    text.truncate(text.floor_char_boundary(MAX_TEXT));
    text
}

impl Validate for Reject {
    fn validate(&self) -> Result<(), Reject> {
        check::text("reason", &self.reason)?;
        check::optional_text("field", self.field.as_deref())
    }
}

impl From<&DecodeError> for Reject {
    fn from(error: &DecodeError) -> Self {
        let code = match error {
            DecodeError::Oversize { .. } => RejectCode::Oversize,
            DecodeError::Encoding { .. } | DecodeError::Name { .. } | DecodeError::Version { .. } => {
                RejectCode::Version
            }
            DecodeError::Malformed { .. } | DecodeError::Structure { .. } => RejectCode::Malformed,
            DecodeError::Invalid { reject, .. } => return reject.clone(),
        };
        Self::new(code, error.to_string())
    }
}
