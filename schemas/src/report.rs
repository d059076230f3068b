//! A planning cycle in full, for recorders and viewers.

use crate::array::F64Array;
use crate::candidates::CandidateSet;
use crate::check;
use crate::decision::{Decision, Evaluated};
use crate::limits::{MAX_PEOPLE, MAX_TERMS};
use crate::map::MapId;
use crate::message::Validate;
use crate::reject::Reject;
use crate::scene::Scene;
use serde::{Deserialize, Serialize};

/// One term of the cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TermReport {
    /// What it measures.
    pub metric: String,
    /// Its weight in the cost.
    pub weight: f64,
    /// What the raw cost is divided by.
    pub scale: f64,
    /// Whether its condition held in this cycle.
    pub active: bool,
    /// `[count]` raw costs, in the metric's own unit; empty if it was not evaluated.
    pub raw: F64Array,
    /// Who evaluated it.
    pub evaluated: Evaluated,
}

impl TermReport {
    fn validate(&self, candidates: usize) -> Result<(), Reject> {
        check::id("metric", &self.metric)?;
        check::numbers(&[("weight", self.weight)])?;
        check::positive(&[("scale", self.scale)])?;
        let expected = if self.raw.is_empty() { 0 } else { candidates };
        check::arrays(expected, &[("raw", &self.raw)])
    }
}

/// Time one metric took.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct MetricTime {
    /// What was measured.
    pub metric: String,
    /// Microseconds from asking to the last answer.
    pub us: u64,
}

/// Where a cycle's time went, microseconds.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Timings {
    /// Asking the generator.
    pub generate_us: u64,
    /// Asking for each metric; they overlap.
    pub evaluate_us: Vec<MetricTime>,
    /// Choosing.
    pub arbitrate_us: u64,
    /// The whole cycle.
    pub total_us: u64,
}

impl Validate for Timings {
    fn validate(&self) -> Result<(), Reject> {
        check::at_most("evaluate_us", self.evaluate_us.len(), MAX_TERMS)?;
        self.evaluate_us.iter().try_for_each(|time| check::id("evaluate_us.metric", &time.metric))
    }
}

/// A person or a cluster of people as the crowd density model sees it: one normal distribution.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Crowd {
    /// Mean, map frame, m.
    pub x: f64,
    /// Mean, map frame, m.
    pub y: f64,
    /// Variance along each axis (the paper's equation 17), m^2.
    pub sigma: f64,
    /// Weight in the mixture.
    pub weight: f64,
    /// People in it.
    pub members: u32,
}

impl Validate for Crowd {
    fn validate(&self) -> Result<(), Reject> {
        check::numbers(&[("x", self.x), ("y", self.y)])?;
        check::non_negative(&[("sigma", self.sigma), ("weight", self.weight)])
    }
}

/// Everything that went into a decision.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CycleReport {
    /// Robot.
    pub robot: String,
    /// Arbiter's incarnation.
    pub epoch: u64,
    /// Planning cycle within the epoch.
    pub seq: u64,
    /// The map, by hash.
    pub map: MapId,
    /// The moment planned from.
    pub scene: Scene,
    /// What could be done.
    pub candidates: CandidateSet,
    /// What each would cost, term by term.
    pub terms: Vec<TermReport>,
    /// `[count]` total costs; 0 for a rejected candidate.
    pub total: F64Array,
    /// `[count]` why a candidate was rejected; empty if it was not.
    pub rejected: Vec<String>,
    /// Index of the candidate chosen; absent if none was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<u32>,
    /// What was decided.
    pub decision: Decision,
    /// Where the time went.
    pub timings: Timings,
    /// The crowd density model's mixture.
    pub crowds: Vec<Crowd>,
    /// Planning ticks since the previous report that have none: ticks skipped because a cycle took too long or
    /// their belief never came, and decisions that no cycle led to.
    pub gap: u64,
}

impl Validate for CycleReport {
    fn validate(&self) -> Result<(), Reject> {
        check::id("robot", &self.robot)?;
        check::part("scene", &self.scene)?;
        check::part("candidates", &self.candidates)?;
        let count = self.candidates.count as usize;
        check::at_most("terms", self.terms.len(), MAX_TERMS)?;
        for (index, term) in self.terms.iter().enumerate() {
            term.validate(count).map_err(|reject| reject.within(&format!("terms[{index}]")))?;
        }
        check::arrays(count, &[("total", &self.total)])?;
        check::length("rejected", self.rejected.len(), count)?;
        check::texts("rejected", &self.rejected, count)?;
        if self.chosen.is_some_and(|chosen| chosen >= self.candidates.count) {
            return Err(Reject::invalid("chosen", "there is no such candidate"));
        }
        check::part("decision", &self.decision)?;
        check::part("timings", &self.timings)?;
        check::at_most("crowds", self.crowds.len(), MAX_PEOPLE)?;
        self.crowds.iter().try_for_each(|crowd| check::part("crowds", crowd))
    }
}
