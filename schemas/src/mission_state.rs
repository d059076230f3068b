//! How time passes for a mission, and where it stands.

use serde::{Deserialize, Serialize};
use strum::IntoStaticStr;

/// How time passes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Clock {
    /// Every stream is awaited: a slow machine changes no decision.
    Lockstep,
    /// The newest wins; budgets are real.
    Realtime,
}

/// Where a mission stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum MissionState {
    /// Waiting for the required roles to report ready.
    Preparing,
    /// Under way.
    Running,
    /// Halted until resumed.
    Paused,
    /// Given up on request.
    Cancelled,
    /// At its end.
    Finished,
}

impl MissionState {
    /// Its name as it stands on the wire.
    pub fn name(self) -> &'static str {
        self.into()
    }
}
