//! What a service says about itself.

use crate::check;
use crate::limits::MAX_LIST;
use crate::message::Validate;
use crate::reject::Reject;
use serde::{Deserialize, Serialize};

/// The answer to a status query.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ServiceStatus {
    /// What it does.
    pub role: String,
    /// Which one it is.
    pub instance: String,
    /// Version of the program.
    pub version: String,
    /// Since it started, s.
    pub uptime_s: f64,
    /// Share of its capacity in use: 1 is full, more is a queue.
    pub load: f64,
    /// Requests taken since it started.
    pub requests: u64,
    /// Requests refused since it started.
    pub rejected: u64,
    /// Median time to serve a request, ms.
    pub p50_ms: f64,
    /// 99th percentile of it, ms.
    pub p99_ms: f64,
    /// What it is prepared for: `map HASH`, `goal X Y on HASH`, `sensor BEAMS over FOV rad to RANGE m on HASH`.
    pub warmed: Vec<String>,
}

impl Validate for ServiceStatus {
    fn validate(&self) -> Result<(), Reject> {
        check::id("role", &self.role)?;
        check::id("instance", &self.instance)?;
        check::text("version", &self.version)?;
        check::non_negative(&[
            ("uptime_s", self.uptime_s),
            ("load", self.load),
            ("p50_ms", self.p50_ms),
            ("p99_ms", self.p99_ms),
        ])?;
        check::texts("warmed", &self.warmed, MAX_LIST)
    }
}
