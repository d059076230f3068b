//! A planning cycle in full, for recorders and viewers.

use crate::array::{F64Array, U32Array};
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
    /// `[count]` weighted costs: what it adds to the total; empty if it was not evaluated.
    #[serde(default, skip_serializing_if = "is_empty")]
    pub cost: F64Array,
    /// Indices of the candidates it has not scored, whose raw and weighted costs are 0.
    #[serde(default, skip_serializing_if = "has_none")]
    pub missing: U32Array,
    /// Index of the candidate that would have been followed by this term alone; so for those below. All are absent
    /// if none was followed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub alone: Option<u32>,
    /// With a weight of 0; absent if it is the only term.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub without: Option<u32>,
    /// With its weight doubled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub doubled: Option<u32>,
    /// With its weight halved.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub halved: Option<u32>,
}

fn is_empty(array: &F64Array) -> bool {
    array.is_empty()
}

fn has_none(array: &U32Array) -> bool {
    array.is_empty()
}

/// Refuses an index beyond `candidates`.
fn exists(field: &str, index: Option<u32>, candidates: usize) -> Result<(), Reject> {
    match index {
        Some(index) if index as usize >= candidates => {
            Err(Reject::invalid(field, "there is no such candidate"))
        }
        _ => Ok(()),
    }
}

impl TermReport {
    fn validate(&self, candidates: usize) -> Result<(), Reject> {
        let indices = [
            ("missing", self.missing.iter().copied().max()),
            ("alone", self.alone),
            ("without", self.without),
            ("doubled", self.doubled),
            ("halved", self.halved),
        ];
        indices.into_iter().try_for_each(|(field, index)| exists(field, index, candidates))?;
        check::at_most("missing", self.missing.len(), candidates)?;
        check::id("metric", &self.metric)?;
        check::numbers(&[("weight", self.weight)])?;
        check::positive(&[("scale", self.scale)])?;
        let all_or_none = |array: &F64Array| if array.is_empty() { 0 } else { candidates };
        check::arrays(all_or_none(&self.raw), &[("raw", &self.raw)])?;
        check::arrays(all_or_none(&self.cost), &[("cost", &self.cost)])
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
    /// `[count]` total costs, the sum of the active terms'; 0 for a candidate that one of them has not scored.
    pub total: F64Array,
    /// `[count]` why a candidate was rejected; empty if it was not.
    pub rejected: Vec<String>,
    /// Index of the candidate chosen; absent if none was.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub chosen: Option<u32>,
    /// Index of the candidate that would have been followed without the chosen one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub runner_up: Option<u32>,
    /// Its total minus that of the chosen one; negative if cost alone did not decide.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub margin: Option<f64>,
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
        exists("chosen", self.chosen, count)?;
        exists("runner_up", self.runner_up, count)?;
        check::optional("margin", self.margin)?;
        check::part("decision", &self.decision)?;
        check::part("timings", &self.timings)?;
        check::at_most("crowds", self.crowds.len(), MAX_PEOPLE)?;
        self.crowds.iter().try_for_each(|crowd| check::part("crowds", crowd))
    }
}
