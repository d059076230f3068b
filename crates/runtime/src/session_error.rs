//! What goes wrong with sessions, above all with their configuration.

use zenoh::Config;

/// Why a session could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// No router answered in time.
    #[error(
        "no router answered at {endpoints} within {seconds:.0} s: \
         is `curionav router` (or `curionav up`) running there?"
    )]
    NoRouter {
        /// The endpoints tried.
        endpoints: String,
        /// How long.
        seconds: f64,
    },
    /// A router answered, but one of both does not trust the other's certificate.
    #[error("the router at {endpoints} was not reached over TLS: {reason}")]
    Distrust {
        /// The endpoints tried.
        endpoints: String,
        /// What TLS says of it.
        reason: String,
    },
    /// There is no certificate that can be used: what is wrong with it, and what mends it.
    #[error("{0}")]
    Certificate(String),
    /// A configuration value was refused, an address cannot be used, or Zenoh has failed: what and why.
    #[error("{0}")]
    Other(String),
}

impl SessionError {
    pub(crate) fn config(reason: impl std::fmt::Display) -> Self {
        Self::Other(format!("Zenoh configuration: {reason}"))
    }

    pub(crate) fn listen(endpoint: &str, reason: impl std::fmt::Display) -> Self {
        Self::Other(format!("cannot listen on {endpoint}: {reason}"))
    }
}

/// Sets keys of a configuration to values in json5.
pub(crate) fn set(config: &mut Config, settings: &[(&str, &str)]) -> Result<(), SessionError> {
    settings.iter().try_for_each(|(key, value)| {
        config.insert_json5(key, value).map_err(|e| SessionError::config(format!("{key}: {e}")))
    })
}
