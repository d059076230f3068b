//! Talking to a simulated world: inject a scenario, watch the run.

use crate::check::{checks, id, non_negative, optional, parameters, part, positive, size};
use crate::limits::{MAX_FILE_NAME, MAX_FILES};
use crate::{Clock, MissionEnd, Refusal, Reject, RunResult};
use ciborium::Value;
use serde::{Deserialize, Serialize};
use serde_bytes::ByteBuf;
use std::collections::BTreeMap;

/// Run this scenario; the reply is a [`RunStatus`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct InjectRequest {
    /// The scenario: a map, as in a scenario file.
    pub scenario: Value,
    /// Files the scenario names, by the path it names them with.
    pub files: BTreeMap<String, ByteBuf>,
    /// The whole planner profile: a map, as in a profile file.
    pub profile: Value,
    /// Seed; absent for the scenario's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub seed: Option<u64>,
    /// How time passes.
    pub clock: Clock,
    /// Simulated seconds per second of wall time, with a real-time clock.
    pub time_scale: f64,
}

checks! { request: InjectRequest {
    scenario: parameters;
    files: |field: &str, files: &BTreeMap<String, ByteBuf>| {
        size(field, files.len(), 0, MAX_FILES)?;
        files.keys().try_for_each(|name| check_file_name(name))
    };
    profile: parameters;
    time_scale: positive;
}}

/// A relative path of plain parts: it can neither leave the directory it is put in nor mean a device or a drive. Parts
/// may have letters of any language, blanks and brackets.
fn check_file_name(name: &str) -> Result<(), Reject> {
    let allowed =
        |c: char| !c.is_control() && !matches!(c, '\\' | ':' | '~' | '*' | '?' | '"' | '<' | '>' | '|');
    let plain = |part: &str| !part.is_empty() && !part.starts_with(['.', ' ']) && !part.ends_with(['.', ' ']);
    if name.len() <= MAX_FILE_NAME && name.chars().all(allowed) && name.split('/').all(plain) {
        return Ok(());
    }
    Err(Refusal::UnsafePath { found: name.chars().take(64).collect() }.at("files"))
}

/// Where a world's run stands.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum RunState {
    /// No scenario.
    Idle,
    /// Waiting for the services to be ready.
    Preparing,
    /// Under way.
    Running,
    /// Over, with a result.
    Finished,
    /// Over, with an error.
    Failed,
}

/// How a world's run goes.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunStatus {
    /// Rises with every run, also over a restart of the simulator.
    pub run: u64,
    /// World.
    pub world: String,
    /// Where it stands.
    pub state: RunState,
    /// Ticks simulated.
    pub tick: u64,
    /// Simulated time, s.
    pub time_s: f64,
    /// True distance to the goal, m.
    pub distance_to_goal: f64,
    /// Why it failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<MissionEnd>,
    /// How it ended.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub result: Option<RunResult>,
}

checks! { status: RunStatus {
    world: id;
    time_s, distance_to_goal: non_negative;
    error: optional(part);
    result: optional(part);
}}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_name_stays_where_it_is_put() {
        for good in [
            "map.pgm",
            "maps/env 4.yaml",
            "a_b-c.2.toml",
            "büro_地図.pgm",
            "hall (2) [new].pgm",
            "l'étage & +1,5.png",
        ] {
            assert!(check_file_name(good).is_ok(), "{good}");
        }
        let long = "a".repeat(256);
        for bad in [
            "",
            "/etc/passwd",
            "../x",
            "a/../b",
            "a//b",
            "a/",
            ".",
            "..",
            ".ssh/id",
            "a/.",
            "C:\\x",
            "c:x",
            "a\\b",
            "a\0b",
            "x.",
            "~root",
            &long,
        ] {
            assert!(check_file_name(bad).is_err(), "{bad:?}");
        }
    }
}
