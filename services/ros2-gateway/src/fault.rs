//! What is wrong with something that the robot has said.

use std::fmt::{Display, Formatter};

use curionav_ros2::cdr::{CdrError, CdrFault};

/// Why something of the robot is not used.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum FaultKind {
    /// Its bytes, its attachment or its numbers are no message.
    Malformed,
    /// It has more bytes than a message of its type may have here.
    TooLong,
    /// It is said in a frame that leads nowhere.
    UnknownFrame,
    /// It is a message, but nothing can be done with it.
    Unusable,
    /// Its stamp lies too far from the robot's clock.
    Stale,
    /// What it needs is not known yet.
    NotYet,
}

impl FaultKind {
    /// As a label of a metric has it.
    pub(crate) fn code(self) -> &'static str {
        match self {
            Self::Malformed => "malformed",
            Self::TooLong => "too_long",
            Self::UnknownFrame => "unknown_frame",
            Self::Unusable => "unusable",
            Self::Stale => "stale",
            Self::NotYet => "not_yet",
        }
    }
}

/// A kind of fault and what exactly is wrong, in words.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Fault {
    /// What kind.
    pub(crate) kind: FaultKind,
    /// What exactly.
    pub(crate) detail: String,
}

impl Fault {
    /// Of this kind. Names from the network may be in the detail, which goes to terminals: they command none.
    pub(crate) fn new(kind: FaultKind, detail: impl Into<String>) -> Self {
        Self { kind, detail: detail.into().replace(char::is_control, "\u{fffd}") }
    }

    /// Its numbers are none.
    pub(crate) fn malformed(detail: impl Into<String>) -> Self {
        Self::new(FaultKind::Malformed, detail)
    }

    /// Its bytes cannot be read.
    pub(crate) fn unread(error: &CdrError) -> Self {
        match error.fault {
            CdrFault::TooLong { .. } => Self::new(FaultKind::TooLong, format!("it is too large: {error}")),
            _ => Self::malformed(error.to_string()),
        }
    }

    /// Nothing can be done with it.
    pub(crate) fn unusable(detail: impl Into<String>) -> Self {
        Self::new(FaultKind::Unusable, detail)
    }

    /// It is said in this frame, and no transform leads from there to one that is known.
    pub(crate) fn unknown_frame(found: &str, known: &str) -> Self {
        Self::new(
            FaultKind::UnknownFrame,
            format!("no transform leads from the frame `{found}` to `{known}`"),
        )
    }
}

impl Display for Fault {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.detail)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_of_the_network_commands_no_terminal() {
        let said = Fault::unknown_frame("\u{1b}[2J\nmap", "odom").to_string();
        assert_eq!(said, "no transform leads from the frame `\u{fffd}[2J\u{fffd}map` to `odom`");
    }
}
