//! Exit statuses, stable because people script against them.

/// The run ended as hoped.
pub(crate) const SUCCESS: u8 = 0;
/// The run took place but failed: collision, timeout or lost.
pub(crate) const FAILED: u8 = 1;
/// A file, field or argument is wrong.
pub(crate) const BAD_INPUT: u8 = 2;
/// The network or a required service is lost.
pub(crate) const NO_NETWORK: u8 = 3;

/// An error that ends the program, with its status.
#[derive(Debug)]
pub(crate) struct Exit {
    pub(crate) code: u8,
    error: anyhow::Error,
}

impl Exit {
    pub(crate) fn failed(error: anyhow::Error) -> Self {
        Self { code: FAILED, error }
    }

    pub(crate) fn bad_input(error: anyhow::Error) -> Self {
        Self { code: BAD_INPUT, error }
    }

    pub(crate) fn network(error: anyhow::Error) -> Self {
        Self { code: NO_NETWORK, error }
    }

    /// The error and its causes on one line.
    pub(crate) fn line(&self) -> String {
        format!("{:#}", self.error).replace('\n', " ")
    }
}

impl std::fmt::Display for Exit {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.line())
    }
}

impl std::error::Error for Exit {}
