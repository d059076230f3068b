//! What goes wrong with sessions, above all with their configuration.

use zenoh::Config;

use crate::endpoint::AddressError;
use crate::exit::Exit;

/// What is asked where nothing better is known.
pub(crate) const IS_IT_RUNNING: &str = "is `curionav router` (or `curionav up`) running there?";

/// Why a session could not be opened.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// No router answered in time.
    #[error("no router answered at {endpoints} within {seconds:.0} s: {hint}")]
    NoRouter {
        /// The endpoints tried.
        endpoints: String,
        /// How long.
        seconds: f64,
        /// Why, as far as it can be found out, or what to look for.
        hint: String,
    },
    /// A router answered, but one of both does not trust the other's certificate.
    #[error("the router at {endpoints} was not reached over TLS: {reason}")]
    Distrust {
        /// The endpoints tried.
        endpoints: String,
        /// What TLS says of it.
        reason: String,
    },
    /// A certificate, an endpoint, a namespace or a configuration cannot be used: what is wrong with it, and what mends
    /// it.
    #[error("{0}")]
    Input(String),
    /// An address is taken, or Zenoh has failed: what and why.
    #[error("{0}")]
    Other(String),
}

impl SessionError {
    pub(crate) fn config(reason: impl std::fmt::Display) -> Self {
        Self::Input(format!("Zenoh configuration: {}", without_places(&reason.to_string())))
    }

    pub(crate) fn listen(endpoint: &str, reason: impl std::fmt::Display) -> Self {
        Self::Other(format!("cannot listen on {endpoint}: {}", without_places(&reason.to_string())))
    }
}

impl From<AddressError> for SessionError {
    fn from(error: AddressError) -> Self {
        Self::Input(error.to_string())
    }
}

impl From<SessionError> for Exit {
    /// The network, unless what was given is wrong.
    fn from(error: SessionError) -> Self {
        match error {
            SessionError::Input(_) => Self::bad_input(error),
            error => Self::network(error),
        }
    }
}

/// A message of Zenoh's without the lines of code in it (`at /build/src/config.rs:12.`), which say nothing to a user.
pub(crate) fn without_places(text: &str) -> String {
    let words: Vec<&str> = text.split(' ').collect();
    let is_place = |i: usize| words.get(i).is_some_and(|word| word.contains(".rs:"));
    let is_kept = |i: usize| !(is_place(i) || words[i] == "at" && is_place(i + 1));
    let kept: Vec<&str> = (0..words.len()).filter(|&i| is_kept(i)).map(|i| words[i]).collect();
    kept.join(" ")
}

/// Sets keys of a configuration to values in json5.
pub(crate) fn set(config: &mut Config, settings: &[(&str, &str)]) -> Result<(), SessionError> {
    settings.iter().try_for_each(|(key, value)| {
        config.insert_json5(key, value).map_err(|e| SessionError::config(format!("{key}: {e}")))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_code_are_taken_out_of_messages() {
        let text = "no such key at /build/a/lib.rs:12. - Caused by port taken at b/tcp.rs:7.";
        assert_eq!(without_places(text), "no such key - Caused by port taken");
        assert_eq!(without_places("look at the port"), "look at the port");
    }
}
