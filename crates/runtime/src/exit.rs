//! Exit statuses, stable because people script against them.

/// The run ended as hoped.
pub const SUCCESS: u8 = 0;
/// The run took place but failed: collision, timeout or lost.
pub const FAILED: u8 = 1;
/// A file, field or argument is wrong.
pub const BAD_INPUT: u8 = 2;
/// The network or a required service is lost.
pub const NO_NETWORK: u8 = 3;

/// An error that ends the program, with its status.
#[derive(Debug, thiserror::Error)]
#[error("{}", self.line())]
pub struct Exit {
    /// The status, one of those above.
    pub code: u8,
    error: anyhow::Error,
}

impl Exit {
    /// With the status [`FAILED`].
    pub fn failed(error: impl Into<anyhow::Error>) -> Self {
        Self { code: FAILED, error: error.into() }
    }

    /// With the status [`BAD_INPUT`].
    pub fn bad_input(error: impl Into<anyhow::Error>) -> Self {
        Self { code: BAD_INPUT, error: error.into() }
    }

    /// With the status [`NO_NETWORK`].
    pub fn network(error: impl Into<anyhow::Error>) -> Self {
        Self { code: NO_NETWORK, error: error.into() }
    }

    /// The error and its causes on one line.
    pub fn line(&self) -> String {
        format!("{:#}", self.error).replace('\n', " ")
    }
}
