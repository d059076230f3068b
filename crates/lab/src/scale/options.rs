//! What to measure.

use std::path::PathBuf;

use crate::service_kind::Kind;

/// What to measure, and with what.
#[derive(Debug, Clone)]
pub struct Options {
    /// Which service: generator, cpc or cnc; may be absent only with `overhead`.
    pub service: Option<Kind>,
    /// Numbers of replicas; the first is what the others are compared with. Empty: the default of the measurement.
    pub replicas: Vec<u16>,
    /// Share of a processor that each replica gets; unlimited if absent.
    pub cpu_quota: Option<f64>,
    /// Candidates in a batch; several with `break_even`. Empty: the default of the measurement.
    pub batch: Vec<u32>,
    /// People around the robot; several with `break_even`. Empty: as in the scenario.
    pub people: Vec<u32>,
    /// How long to measure each row, seconds; absent: the default of the measurement.
    pub seconds: Option<f64>,
    /// Batches in flight for each replica while throughput is measured, each of one robot.
    pub in_flight: u16,
    /// Scenario that scenes and candidates are taken from.
    pub scenario: PathBuf,
    /// A built-in profile or a profile file; the scenario's if absent.
    pub planner: Option<String>,
    /// Find out from which batch on asking replicas is faster than computing in the arbiter.
    pub break_even: bool,
    /// Numbers of robots that plan over one pool.
    pub robots: Vec<u16>,
    /// Measure what splitting the cycle into processes costs.
    pub overhead: bool,
    /// Print one JSON object instead of a table.
    pub json: bool,
}

impl Options {
    /// The numbers of replicas, or `default`.
    pub(super) fn replicas_or(&self, default: &[u16]) -> Vec<usize> {
        let replicas = if self.replicas.is_empty() { default } else { &self.replicas };
        replicas.iter().map(|&n| usize::from(n)).collect()
    }
}
