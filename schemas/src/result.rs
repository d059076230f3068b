//! How a run ended, with everything needed to draw and judge it.

use crate::check::{
    array, checks, count, each, exactly, fraction, id, keys, length, list, named_numbers, non_negative,
    number, optional, part, shape, text,
};
use crate::limits::{MAX_CONTACTS, MAX_LIST, MAX_PEOPLE, MAX_TRACE_COLUMNS, MAX_TRACE_ROWS};
use crate::{F32Array, F64Array, MapId, Refusal, Reject, U8Array, U32Array};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use strum::IntoStaticStr;

/// How it ended.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, IntoStaticStr)]
#[serde(rename_all = "snake_case")]
#[strum(serialize_all = "snake_case")]
pub enum Outcome {
    /// At the goal, in truth.
    Reached,
    /// Time ran out.
    Timeout,
    /// The robot is not where it believes it is.
    Lost,
    /// Obstacles that are on no map close every way to the goal, or people stand there.
    NoWay,
}

/// The measures of the paper and a few more.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Measures {
    /// Root mean square of the localisation error, m.
    pub rmse_m: f64,
    /// Share of the run before localisation first converged, 0..1; 1 if it never did.
    pub tcm: f64,
    /// Times localisation lost convergence after that; absent if it never converged.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub nm: Option<u32>,
    /// Time until the error of localisation stayed below 0.3 m for 2 s, s; absent if it never did.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tce_s: Option<f64>,
    /// Fraction of the time closer to people than comfortable, 0..1.
    pub td: f64,
    /// Least distance between the centres of the robot and any person, m; absent if there were no people.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub md_m: Option<f64>,
    /// The fraction of `td` among people that no wall hides from the robot, 0..1; absent in results of older programs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub td_in_view: Option<f64>,
    /// Least distance between the centres of the robot and a person that no wall hides from it, m; absent if there
    /// never was one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub md_in_view_m: Option<f64>,
    /// Times the robot came closer than comfortable.
    pub nt: u32,
    /// Mean speed, m/s.
    pub vel_mps: f64,
    /// Distance driven, m.
    pub length_m: f64,
    /// Duration, s.
    pub time_s: f64,
    /// Contacts while driving.
    pub collisions: u32,
    /// Least distance between the robot's outline and a person's or a wall, m; negative in contact.
    pub clearance_min_m: f64,
}

checks! { measures: Measures {
    tcm, td: fraction;
    md_m, md_in_view_m: optional(number);
    td_in_view: optional(fraction);
    tce_s: optional(non_negative);
    rmse_m, vel_mps, length_m, time_s: non_negative;
    clearance_min_m: number;
}}

/// The planning cycles of a run; wall times.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Cycles {
    /// How many.
    pub count: u64,
    /// Ticks that a cycle was due in and that had none.
    #[serde(default)]
    pub skipped: u64,
    /// How many were decided only after the next one was due.
    #[serde(default)]
    pub late: u64,
    /// In how many the robot was told to follow the candidate that the planner wanted most.
    #[serde(default)]
    pub first_choice: u64,
    /// In how many it was told otherwise, by the code of the reason; one that did not occur is absent.
    #[serde(default)]
    pub other_choice: BTreeMap<String, u64>,
    /// How many were degraded.
    pub degraded: u64,
    /// In how many each degradation occurred, by its code; one that did not occur is absent.
    #[serde(default)]
    pub degraded_by: BTreeMap<String, u64>,
    /// Median, ms.
    pub p50_ms: f64,
    /// 99th percentile, ms.
    pub p99_ms: f64,
    /// Longest, ms.
    pub max_ms: f64,
}

checks! { cycles: Cycles {
    other_choice, degraded_by: keys(MAX_LIST);
    p50_ms, p99_ms, max_ms: non_negative;
}}

/// Where the people were, at the rows of the trace that holds this.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct PeopleTrace {
    /// Rows; those of the trace, or 0 if people were not recorded.
    pub rows: u32,
    /// `[people]` identifiers.
    pub id: U32Array,
    /// `[rows, people, 2]` position, map frame, m; 0 where absent.
    pub xy: F32Array,
    /// `[rows, people]` 1 where the person was there, else 0.
    pub present: U8Array,
}

checks! { people: PeopleTrace {
    rows: count(0, MAX_TRACE_ROWS);
    id: length(0, MAX_PEOPLE);
    xy: array(2 * people.rows as usize * people.id.len());
    present: exactly(people.rows as usize * people.id.len());
    present: each(fraction);
}}

/// What happened, tick by tick; of a run that is too long for one message, at evenly spaced ticks.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Trace {
    /// Rows.
    pub rows: u32,
    /// Names of the columns.
    pub columns: Vec<String>,
    /// `[rows, columns]`.
    pub values: F64Array,
    /// The people.
    pub people: PeopleTrace,
}

impl Trace {
    /// The values of a column, one per row; none if there is no such column.
    pub fn column<'a>(&'a self, name: &str) -> impl Iterator<Item = f64> + use<'a> {
        let index = self.columns.iter().position(|column| column == name);
        let values = |index| self.values.iter().skip(index).step_by(self.columns.len()).copied();
        index.map(values).into_iter().flatten()
    }
}

checks! { trace: Trace {
    rows: count(0, MAX_TRACE_ROWS);
    columns: list(MAX_TRACE_COLUMNS, id);
    values: array(trace.rows as usize * trace.columns.len());
    people: part;
    people: |_: &str, people: &PeopleTrace| match people.rows {
        0 => Ok(()),
        rows => shape("people.rows", rows as usize, trace.rows as usize),
    };
}}

/// The first moment of a contact in which the robot was moving.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Contact {
    /// Since the start, s.
    pub time_s: f64,
    /// The person's identifier; absent for a wall.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub person: Option<u32>,
    /// How fast the robot came towards the person or hit the wall, m/s; negative if it went away.
    pub robot_mps: f64,
    /// How fast the person came towards the robot, m/s; negative if the person went away, 0 for a wall.
    pub person_mps: f64,
}

checks! { contact: Contact {
    time_s: non_negative;
    robot_mps, person_mps: number;
}}

/// A run that came to an end.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct RunResult {
    /// Which scenario.
    pub scenario: String,
    /// Which planner profile.
    pub planner: String,
    /// Seed.
    pub seed: u64,
    /// How it ended.
    pub outcome: Outcome,
    /// How well.
    pub measures: Measures,
    /// The collisions, in their order; the first [`MAX_CONTACTS`] of them.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub contacts: Vec<Contact>,
    /// The standard measures of social navigation by name, such as `spl`, `personal_share` or
    /// `time_to_collision_min_s`; units are in the names, yes and no are 1 and 0, and what there was nothing to
    /// measure of is absent. New ones may come.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub social: BTreeMap<String, f64>,
    /// At what effort.
    pub cycles: Cycles,
    /// Simulated seconds per second of wall time.
    pub real_time_factor: f64,
    /// SHA-256 over scene stamps, actions and chosen trajectories, 64 lower-case hexadecimal digits.
    pub decisions_sha256: String,
    /// What happened.
    pub trace: Trace,
}

checks! { result: RunResult {
    scenario, planner: text;
    measures: part;
    contacts: list(MAX_CONTACTS, part);
    social: keys(MAX_LIST);
    social: named_numbers;
    cycles: part;
    real_time_factor: non_negative;
    decisions_sha256: hash;
    trace: part;
}}

fn hash(field: &str, text: &str) -> Result<(), Reject> {
    text.parse::<MapId>().map(drop).map_err(|_| Refusal::NotAHash.at(field))
}
