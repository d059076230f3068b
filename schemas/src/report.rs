//! A planning cycle in full, for recorders and viewers.

use crate::check::{
    array, ascending, checks, id, length, list, non_negative, number, optional, part, positive, size,
};
use crate::limits::{MAX_OBSTACLE_CELLS, MAX_PEOPLE, MAX_TERMS};
use crate::{
    CandidateSet, Decision, Evaluated, F32Array, F64Array, MapId, Refusal, Reject, Rejection, Scene, Twist,
    U32Array,
};
use serde::{Deserialize, Serialize};

/// One term of the cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TermReport {
    /// The term's name.
    pub term: String,
    /// Its weight in the cost.
    pub weight: f64,
    /// What the raw cost is divided by.
    pub scale: f64,
    /// Whether its condition held in this cycle.
    pub active: bool,
    /// What evaluated it.
    pub evaluated: Evaluated,
    /// Indices of the candidates it has scored, ascending. No other candidate has a cost under it.
    pub scored: U32Array,
    /// `[scored]` raw costs, in the term's own unit.
    pub raw: F64Array,
    /// `[scored]` weighted costs: what it adds to the total.
    pub cost: F64Array,
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

/// A candidate's number in an array that holds some candidates only: `of` are their indices, ascending.
fn of_some(of: &U32Array, numbers: &F64Array, candidate: usize) -> Option<f64> {
    let place = of.binary_search(&u32::try_from(candidate).ok()?).ok()?;
    numbers.get(place).copied()
}

/// Indices of candidates, of which there are `count`, that rise.
fn indices(count: u32) -> impl Fn(&str, &U32Array) -> Result<(), Reject> {
    move |field, indices| {
        ascending(field, indices)?;
        index(count)(field, &indices.last().copied())
    }
}

/// The index of a candidate, of which there are `count`, if there is one.
fn index(count: u32) -> impl Fn(&str, &Option<u32>) -> Result<(), Reject> {
    move |field, index| match *index {
        Some(index) if index >= count => Err(Refusal::NoSuchIndex { found: u64::from(index) }.at(field)),
        _ => Ok(()),
    }
}

impl TermReport {
    /// The raw cost of a candidate, by its index; nothing if the term has not scored it.
    pub fn raw_of(&self, candidate: usize) -> Option<f64> {
        of_some(&self.scored, &self.raw, candidate)
    }

    /// The weighted cost of a candidate, by its index; nothing if the term has not scored it.
    pub fn cost_of(&self, candidate: usize) -> Option<f64> {
        of_some(&self.scored, &self.cost, candidate)
    }

    fn validate(&self, candidates: u32) -> Result<(), Reject> {
        let index = index(candidates);
        index("alone", &self.alone)?;
        index("without", &self.without)?;
        index("doubled", &self.doubled)?;
        index("halved", &self.halved)?;
        id("term", &self.term)?;
        number("weight", &self.weight)?;
        positive("scale", &self.scale)?;
        indices(candidates)("scored", &self.scored)?;
        array(self.scored.len())("raw", &self.raw)?;
        array(self.scored.len())("cost", &self.cost)
    }
}

/// A candidate that was not taken, other than for its cost.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RejectedCandidate {
    /// Its index.
    pub candidate: u32,
    /// Why it was not taken.
    pub why: Rejection,
}

/// Time that the evaluation of one term took.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TermTime {
    /// The term.
    pub term: String,
    /// Microseconds from asking to the last answer.
    pub us: u64,
}

/// Where a cycle's time went, microseconds.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Timings {
    /// Asking the generator.
    pub generate_us: u64,
    /// Asking for each term; they overlap.
    pub evaluate_us: Vec<TermTime>,
    /// Choosing.
    pub arbitrate_us: u64,
    /// The whole cycle.
    pub total_us: u64,
}

checks! { timings: Timings {
    evaluate_us: list(MAX_TERMS, |_, time: &TermTime| id("evaluate_us.term", &time.term));
}}

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

checks! { crowd: Crowd {
    x, y: number;
    sigma, weight: non_negative;
}}

/// What the robot has seen and is on no map: squares of equal size that are turned alike.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ObstacleCells {
    /// Centres, map frame, m.
    pub x: F32Array,
    /// `[x]` centres, map frame, m.
    pub y: F32Array,
    /// Direction of two of their sides, map frame, rad.
    pub heading: f64,
    /// Length of a side, m.
    pub side: f64,
    /// Whether they close every way to the goal.
    pub close_ways: bool,
}

checks! { obstacles: ObstacleCells {
    x: length(0, MAX_OBSTACLE_CELLS);
    x, y: array(obstacles.x.len());
    heading: number;
    side: positive;
}}

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
    /// Indices of the candidates that every active term has scored, ascending. No other candidate has a total.
    pub scored: U32Array,
    /// `[scored]` total costs: the sum of the active terms' weighted costs.
    pub total: F64Array,
    /// The candidates that were rejected, by ascending index.
    pub rejected: Vec<RejectedCandidate>,
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
    /// The scene's obstacles, for those who do not have the map; absent without any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub obstacles: Option<ObstacleCells>,
    /// What the driver has done with the decisions before this cycle; absent until its first command is heard.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub driven: Option<Twist>,
    /// Planning ticks between the previous cycle and this one: they had no cycle, because one took too long or their
    /// belief never came.
    pub gap: u64,
}

impl CycleReport {
    /// The total cost of a candidate, by its index; nothing if an active term has not scored it.
    pub fn total_of(&self, candidate: usize) -> Option<f64> {
        of_some(&self.scored, &self.total, candidate)
    }

    /// Why a candidate was rejected, by its index; nothing if it was not.
    pub fn rejection_of(&self, candidate: usize) -> Option<&Rejection> {
        let place = self.rejected.binary_search_by_key(&candidate, |r| r.candidate as usize).ok()?;
        self.rejected.get(place).map(|rejected| &rejected.why)
    }

    /// What a candidate costs that was compared with the others, by its index; nothing if it was rejected or not
    /// scored.
    pub fn open_cost(&self, candidate: usize) -> Option<f64> {
        self.total_of(candidate).filter(|_| self.rejection_of(candidate).is_none())
    }

    /// [`Self::open_cost`] of all candidates that have one, in their order.
    pub fn open_costs(&self) -> impl Iterator<Item = f64> {
        (0..self.candidates.count as usize).filter_map(|candidate| self.open_cost(candidate))
    }
}

checks! { report: CycleReport {
    robot: id;
    scene: part;
    candidates: part;
    terms: |field: &str, terms: &Vec<TermReport>| {
        size(field, terms.len(), 0, MAX_TERMS)?;
        terms.iter().enumerate().try_for_each(|(index, term)| {
            term.validate(report.candidates.count).map_err(|reject| reject.within(&format!("{field}[{index}]")))
        })
    };
    scored: indices(report.candidates.count);
    total: array(report.scored.len());
    rejected: |field: &str, rejected: &Vec<RejectedCandidate>| {
        indices(report.candidates.count)(field, &rejected.iter().map(|one| one.candidate).collect())?;
        rejected.iter().try_for_each(|one| part(field, &one.why))
    };
    chosen, runner_up: index(report.candidates.count);
    margin: optional(number);
    decision: part;
    timings: part;
    crowds: list(MAX_PEOPLE, part);
    obstacles: optional(part);
    driven: optional(part);
}}
