//! Commands that this build leaves out: each says which feature brings it.

use std::ffi::OsString;

use anyhow::anyhow;
use clap::Args;
use curionav_runtime::exit::Exit;

#[derive(Debug, Args)]
pub(crate) struct LeftOut {
    #[arg(hide = true, trailing_var_arg = true, allow_hyphen_values = true)]
    _arguments: Vec<OsString>,
}

pub(crate) fn error(feature: &str) -> Exit {
    Exit::bad_input(anyhow!(
        "this program was built without the feature `{feature}`, which brings this command: build it with \
         `cargo build --release --features {feature}`"
    ))
}

#[cfg(not(feature = "lab"))]
pub(crate) mod lab {
    use super::LeftOut;
    use clap::Subcommand;
    use curionav_runtime::exit::Exit;

    #[derive(Debug, Subcommand)]
    pub(crate) enum LabCommand {
        /// Compare planners over many runs (needs a build with `--features lab`).
        Bench(LeftOut),
        /// Search for better settings of a planner (needs a build with `--features lab`).
        Tune(LeftOut),
        /// Measure what more replicas bring (needs a build with `--features lab`).
        Scale(LeftOut),
    }

    pub(crate) async fn run(_: LabCommand, _: &str) -> Result<u8, Exit> {
        Err(super::error("lab"))
    }
}

#[cfg(not(feature = "recording"))]
pub(crate) mod recording {
    use super::LeftOut;
    use clap::Subcommand;
    use curionav_runtime::config::ServiceConfig;
    use curionav_runtime::exit::Exit;
    use std::path::Path;
    use zenoh::Session;

    #[derive(Debug, Subcommand)]
    pub(crate) enum RecordingCommand {
        /// Record a robot's messages (needs a build with `--features recording`).
        Record(LeftOut),
        /// Plan recorded cycles again (needs a build with `--features recording`).
        Replay(LeftOut),
        /// Say why a cycle was decided as it was (needs a build with `--features recording`).
        Explain(LeftOut),
    }

    pub(crate) async fn run(_: RecordingCommand) -> Result<u8, Exit> {
        Err(super::error("recording"))
    }

    pub(crate) async fn during<T>(
        _: &Session,
        _: &Path,
        _: &ServiceConfig,
        _: impl Future<Output = Result<T, Exit>>,
    ) -> Result<(T, Result<(), Exit>), Exit> {
        Err(super::error("recording"))
    }
}
