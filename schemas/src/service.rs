//! What a service says about itself.

use crate::check;
use crate::limits::{MAX_LIST, MAX_METRIC_NAME, MAX_METRICS};
use crate::map::MapId;
use crate::message::Validate;
use crate::reject::Reject;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use strum::VariantNames;

/// Something that a service is prepared for.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, VariantNames)]
#[serde(tag = "code", rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Prepared {
    /// It has the map.
    Map {
        /// Its hash.
        map: MapId,
    },
    /// It has the distance to a goal on the map.
    Goal {
        /// The map's hash.
        map: MapId,
        /// Map frame, m.
        x: f64,
        /// Map frame, m.
        y: f64,
    },
    /// It has what a laser sees of the map.
    Sensor {
        /// The map's hash.
        map: MapId,
        /// Beams in a scan.
        beams: u32,
        /// Field of view, rad.
        fov: f64,
        /// Range, m.
        range_max: f64,
    },
    /// It is ready for a revision of the robot's mission.
    Revision {
        /// Which.
        revision: u64,
    },
    /// It cannot prepare for a revision of the robot's mission yet.
    Waiting {
        /// Which.
        revision: u64,
        /// What is not there yet.
        reject: Reject,
    },
}

impl Validate for Prepared {
    fn validate(&self) -> Result<(), Reject> {
        match self {
            Self::Map { .. } | Self::Revision { .. } => Ok(()),
            Self::Goal { x, y, .. } => check::numbers(&[("x", *x), ("y", *y)]),
            Self::Sensor { fov, range_max, .. } => {
                check::positive(&[("fov", *fov), ("range_max", *range_max)])
            }
            Self::Waiting { reject, .. } => check::part("reject", reject),
        }
    }
}

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

impl Validate for ServiceStatus {
    fn validate(&self) -> Result<(), Reject> {
        check::id("role", &self.role)?;
        check::id("instance", &self.instance)?;
        if let Some(robot) = &self.robot {
            check::id("robot", robot)?;
        }
        check::text("version", &self.version)?;
        check::non_negative(&[
            ("uptime_s", self.uptime_s),
            ("load", self.load),
            ("p50_ms", self.p50_ms),
            ("p99_ms", self.p99_ms),
        ])?;
        check::number("time_s", self.time_s)?;
        check::at_most("prepared", self.prepared.len(), MAX_LIST)?;
        self.prepared.iter().try_for_each(|prepared| check::part("prepared", prepared))?;
        check::at_most("metrics", self.metrics.len(), MAX_METRICS)?;
        self.metrics.iter().try_for_each(|(name, value)| {
            check::at_most("metrics: the length of a name", name.len(), MAX_METRIC_NAME)?;
            check::number(&format!("metrics.{name}"), *value)
        })
    }
}
