//! Commands that this build leaves out: each says which feature brings it.

use std::ffi::OsString;

use anyhow::anyhow;
use clap::{Args, Subcommand};
use curionav_runtime::exit::Exit;

/// The arguments of a command that is left out.
#[derive(Debug, Args)]
pub(crate) struct AnyArguments {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _arguments: Vec<OsString>,
}

#[derive(Debug, Subcommand)]
pub(crate) enum LeftOut {
    /// Compare planners over many runs (needs a build with `--features lab`).
    #[cfg(not(feature = "lab"))]
    Bench(AnyArguments),
    /// Search for better settings of a planner (needs a build with `--features lab`).
    #[cfg(not(feature = "lab"))]
    Tune(AnyArguments),
    /// Measure what more replicas bring (needs a build with `--features lab`).
    #[cfg(not(feature = "lab"))]
    Scale(AnyArguments),
    /// Run the localiser on a log of a robot (needs a build with `--features lab`).
    #[cfg(not(feature = "lab"))]
    Localize(AnyArguments),
    /// Certificates and rights for a deployment over TLS (needs a build with `--features tls`).
    #[cfg(not(feature = "tls"))]
    Secure(AnyArguments),
    /// Record a robot's messages (needs a build with `--features recording`).
    #[cfg(not(feature = "recording"))]
    Record(AnyArguments),
    /// Plan recorded cycles again (needs a build with `--features recording`).
    #[cfg(not(feature = "recording"))]
    Replay(AnyArguments),
    /// Explain the decision of a cycle (needs a build with `--features recording`).
    #[cfg(not(feature = "recording"))]
    Explain(AnyArguments),
}

impl LeftOut {
    pub(crate) fn error(&self) -> Exit {
        match self {
            #[cfg(not(feature = "lab"))]
            Self::Bench(_) | Self::Tune(_) | Self::Scale(_) | Self::Localize(_) => left_out("lab"),
            #[cfg(not(feature = "tls"))]
            Self::Secure(_) => left_out("tls"),
            #[cfg(not(feature = "recording"))]
            Self::Record(_) | Self::Replay(_) | Self::Explain(_) => left_out("recording"),
        }
    }
}

/// The error of a command that `feature` brings.
pub(crate) fn left_out(feature: &str) -> Exit {
    Exit::bad_input(anyhow!(
        "this program was built without the feature `{feature}`, which brings this command: build it with \
         `cargo build --release --features {feature}`"
    ))
}
