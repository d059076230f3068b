//! A finished run as the journal keeps it, one line of JSON; and how many ended how.

use std::collections::BTreeMap;

use curionav_own_planner::attended;
use curionav_schemas::{Contact, Cycles, Measures, Outcome, RunResult};
use serde::{Deserialize, Serialize};

/// Seconds from one point of a kept way to the next.
const WAY_STEP_S: f64 = 0.5;

#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Row {
    /// Digest of all that decides the run but the program: scenario, map, recordings, profile, seed.
    pub(crate) key: String,
    pub(crate) program: String,
    pub(crate) scenario: String,
    pub(crate) planner: String,
    pub(crate) seed: u64,
    pub(crate) outcome: Outcome,
    pub(crate) measures: Measures,
    /// The collisions, in their order.
    #[serde(default)]
    pub(crate) contacts: Vec<Contact>,
    /// The measures of social navigation by name.
    #[serde(default)]
    pub(crate) social: BTreeMap<String, f64>,
    pub(crate) cycles: Cycles,
    pub(crate) decisions_sha256: String,
    /// Simulated seconds a second of the run.
    pub(crate) real_time_factor: f64,
    /// Seconds on the clock, with the preparation of the maps.
    pub(crate) wall_s: f64,
    /// Where the robot was, every half second and at the end, m, map frame.
    pub(crate) way: Vec<[f64; 2]>,
    /// What became of the questions to a planner of one's own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(crate) own_planner: Option<attended::Tally>,
}

impl Row {
    pub(crate) fn is_reached(&self) -> bool {
        self.outcome == Outcome::Reached
    }

    /// At the goal without having touched anything.
    pub(crate) fn is_success(&self) -> bool {
        self.is_reached() && self.measures.collisions == 0
    }
}

/// How many runs ended how.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub(crate) struct Tally {
    pub(crate) runs: usize,
    /// At the goal without a collision.
    pub(crate) success: usize,
    pub(crate) timeouts: usize,
    pub(crate) lost: usize,
    pub(crate) no_way: usize,
    pub(crate) collided: usize,
}

impl Tally {
    pub(crate) fn of<'a>(rows: impl Iterator<Item = &'a Row>) -> Self {
        rows.fold(Self::default(), |tally, row| Self {
            runs: tally.runs + 1,
            success: tally.success + usize::from(row.is_success()),
            timeouts: tally.timeouts + usize::from(row.outcome == Outcome::Timeout),
            lost: tally.lost + usize::from(row.outcome == Outcome::Lost),
            no_way: tally.no_way + usize::from(row.outcome == Outcome::NoWay),
            collided: tally.collided + usize::from(row.measures.collisions > 0),
        })
    }
}

/// The true way of a run, thinned, to the centimetre.
pub(crate) fn way(result: &RunResult) -> Vec<[f64; 2]> {
    let column = |name: &str| result.trace.column(name);
    let mut rows = column("time_s").zip(column("true_x").zip(column("true_y"))).peekable();
    let mut due = f64::NEG_INFINITY;
    let mut kept = Vec::new();
    while let Some((time, (x, y))) = rows.next() {
        if time + 1e-9 >= due || rows.peek().is_none() {
            kept.push([x, y].map(|metres| (metres * 100.0).round() / 100.0));
            due = time + WAY_STEP_S;
        }
    }
    kept
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;
    use curionav_testing::golden;

    /// A row to change in a test.
    pub(crate) fn row(scenario: &str, planner: &str, seed: u64) -> Row {
        let result = golden::run_result();
        Row {
            key: format!("{scenario}-{planner}-{seed}"),
            program: "p".into(),
            scenario: scenario.into(),
            planner: planner.into(),
            seed,
            outcome: result.outcome,
            measures: result.measures,
            contacts: result.contacts,
            social: result.social,
            cycles: result.cycles,
            decisions_sha256: result.decisions_sha256,
            real_time_factor: 20.0,
            wall_s: 2.0,
            way: vec![[0.0, 0.0], [1.0, 0.5]],
            own_planner: None,
        }
    }

    #[test]
    fn a_way_keeps_its_ends_and_a_point_every_half_second() {
        let mut result = golden::run_result();
        result.trace.columns = ["time_s", "true_x", "true_y"].map(String::from).to_vec();
        result.trace.values = (0..13).flat_map(|i| [f64::from(i) * 0.1, f64::from(i), 0.123456]).collect();
        assert_eq!(way(&result), [[0.0, 0.12], [5.0, 0.12], [10.0, 0.12], [12.0, 0.12]]);
    }

    #[test]
    fn a_run_with_a_collision_arrived_but_is_no_success() {
        let mut rows = [row("a", "b", 1), row("a", "b", 2), row("a", "b", 3)];
        rows[0].measures.collisions = 3;
        rows[2].outcome = Outcome::Lost;
        let tally = Tally::of(rows.iter());
        assert_eq!((tally.runs, tally.success, tally.timeouts, tally.lost, tally.collided), (3, 1, 0, 1, 1));
    }
}
