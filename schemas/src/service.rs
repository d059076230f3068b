//! What a service says about itself.

use crate::check::{
    checks, id, list, named_numbers, non_negative, number, optional, part, positive, size, text,
};
use crate::limits::{MAX_LIST, MAX_METRIC_NAME, MAX_METRICS};
use crate::{MapId, Reject};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Something that a service is prepared for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "code", rename_all = "snake_case")]
#[expect(missing_docs, reason = "the text of each code says what its parameters are")]
pub enum Prepared {
    /// It has the map of this hash.
    Map { map: MapId },
    /// It has the distance to a goal on the map, m, map frame.
    Goal { map: MapId, x: f64, y: f64 },
    /// It has what a laser of so many beams, with this field of view (rad) and range (m), sees of the map.
    Sensor { map: MapId, beams: u32, fov: f64, range_max: f64 },
    /// It is ready for this revision of the robot's mission.
    Revision { revision: u64 },
    /// It cannot prepare for this revision of the robot's mission yet; the refusal says what is not there.
    Waiting { revision: u64, reject: Reject },
}

checks! { Prepared {
    Goal { x: number, y: number }
    Sensor { fov: positive, range_max: positive }
    Waiting { reject: part }
}}

/// The answer to a status query.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ServiceStatus {
    /// What it does.
    pub role: String,
    /// Which one it is.
    pub instance: String,
    /// The robot it works for, if it works for one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub robot: Option<String>,
    /// Version of the program.
    pub version: String,
    /// Since it started, s.
    pub uptime_s: f64,
    /// Since 1970 began, UTC, by the service's own clock, when it answered, s.
    pub time_s: f64,
    /// Requests waiting or being computed, for each it can compute at once: 1 is full, more is a queue.
    pub load: f64,
    /// Requests answered since it started; of arbiter, driver and localizer ticks.
    pub requests: u64,
    /// Requests refused since it started.
    pub rejected: u64,
    /// Median time to serve a request, ms.
    pub p50_ms: f64,
    /// 99th percentile of it, ms.
    pub p99_ms: f64,
    /// What it is prepared for.
    pub prepared: Vec<Prepared>,
    /// What its metrics endpoint says as well: every sample, by its name and labels as Prometheus writes them.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub metrics: BTreeMap<String, f64>,
}

checks! { status: ServiceStatus {
    role, instance: id;
    robot: optional(id);
    version: text;
    uptime_s, load, p50_ms, p99_ms: non_negative;
    time_s: number;
    prepared: list(MAX_LIST, part);
    metrics: |field: &str, metrics: &BTreeMap<String, f64>| {
        size(field, metrics.len(), 0, MAX_METRICS)?;
        let longest = metrics.keys().map(String::len).max().unwrap_or_default();
        size("metrics: the length of a name", longest, 0, MAX_METRIC_NAME)
    };
    metrics: named_numbers;
}}
