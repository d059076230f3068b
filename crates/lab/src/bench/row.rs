//! A finished run as the journal keeps it, one line of JSON; and how many ended how.

use std::collections::BTreeMap;

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
}

impl Row {
    pub(crate) fn is_reached(&self) -> bool {
        self.outcome == Outcome::Reached
    }

    /// In how many cycles the reason of the decision had this code, where it was not that of the first choice.
    pub(crate) fn decided(&self, code: &str) -> u64 {
        self.cycles.other_choice.get(code).copied().unwrap_or_default()
    }

    /// At the goal without having touched anything.
    pub(crate) fn is_success(&self) -> bool {
        self.is_reached() && self.measures.collisions == 0
    }
}

/// Counts of runs, but for `contacts` and those of cycles.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Tally {
    pub(crate) runs: usize,
    /// At the goal without a collision.
    pub(crate) success: usize,
    pub(crate) reached: usize,
    pub(crate) timeouts: usize,
    pub(crate) lost: usize,
    pub(crate) collided: usize,
    /// Runs in which it touched anything, also while it stood.
    pub(crate) touched: usize,
    /// Collisions in all.
    pub(crate) contacts: u32,
    /// Runs with a cycle that was decided in a degraded mode.
    pub(crate) degraded: usize,
    /// Cycles of all runs.
    pub(crate) cycles: u64,
    /// Cycles in which the candidate that the planner wanted most was followed.
    pub(crate) first_choices: u64,
    /// Cycles in which the final check refused that one and another that is not slow was followed.
    pub(crate) other_free: u64,
    /// Cycles in which only slow candidates passed the final check.
    pub(crate) only_slow: u64,
    /// Cycles in which all that was left collides later than it takes to think again, and the last to collide was followed.
    pub(crate) evading: u64,
    /// Cycles in which no candidate passed it: the robot followed the last trajectory or stopped.
    pub(crate) none_free: u64,
    /// Cycles in which the planner had no candidate, so that there was nothing to choose.
    pub(crate) no_candidates: u64,
    /// Cycles of runs that do not say why the first choice was not followed: rows of an older build.
    pub(crate) untold: u64,
}

/// Collisions, counted by which of robot and person came towards the other.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub(crate) struct Blame {
    pub(crate) walls: usize,
    /// The robot came towards the person no slower than the person towards it.
    pub(crate) robot: usize,
    /// The robot came towards the person, who came faster.
    pub(crate) person: usize,
    /// The robot went away from the person, who came after it.
    pub(crate) run_down: usize,
}

impl Blame {
    pub(crate) fn of<'a>(rows: impl Iterator<Item = &'a Row>) -> Self {
        rows.flat_map(|row| &row.contacts).fold(Self::default(), |mut blame, contact| {
            let Contact { person, robot_mps, person_mps, .. } = *contact;
            let count = match person {
                None => &mut blame.walls,
                Some(_) if robot_mps >= person_mps => &mut blame.robot,
                Some(_) if robot_mps > 0.0 => &mut blame.person,
                Some(_) => &mut blame.run_down,
            };
            *count += 1;
            blame
        })
    }
}

impl Tally {
    /// What [`Self::not_first`] counts, as columns are called.
    pub(crate) const NOT_FIRST: [&str; 5] =
        ["other_free", "only_slow", "evading", "none_free", "no_candidates"];

    /// The cycles that did not follow the first choice, by their reason; nothing if a run does not tell.
    pub(crate) fn not_first(&self) -> Option<[u64; 5]> {
        let Self { other_free, only_slow, evading, none_free, no_candidates, untold, .. } = *self;
        (untold == 0).then_some([other_free, only_slow, evading, none_free, no_candidates])
    }

    pub(crate) fn of<'a>(rows: impl Iterator<Item = &'a Row>) -> Self {
        rows.fold(Self::default(), |t, row| Self {
            runs: t.runs + 1,
            success: t.success + usize::from(row.is_success()),
            reached: t.reached + usize::from(row.is_reached()),
            timeouts: t.timeouts + usize::from(row.outcome == Outcome::Timeout),
            lost: t.lost + usize::from(row.outcome == Outcome::Lost),
            collided: t.collided + usize::from(row.measures.collisions > 0),
            touched: t.touched + usize::from(row.measures.clearance_min_m <= 0.0),
            contacts: t.contacts + row.measures.collisions,
            degraded: t.degraded + usize::from(row.cycles.degraded > 0),
            cycles: t.cycles + row.cycles.count,
            first_choices: t.first_choices + row.cycles.first_choice,
            other_free: t.other_free + row.decided("least_cost_free"),
            only_slow: t.only_slow + row.decided("only_slow_free"),
            evading: t.evading + row.decided("last_to_collide"),
            none_free: t.none_free + row.decided("none_free"),
            no_candidates: t.no_candidates + row.decided("no_candidates"),
            untold: t.untold
                + row
                    .cycles
                    .count
                    .saturating_sub(row.cycles.first_choice + row.cycles.other_choice.values().sum::<u64>()),
        })
    }

    /// The share of the runs that reached the goal without a collision.
    pub(crate) fn share(&self) -> f64 {
        self.success as f64 / self.runs.max(1) as f64
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
    fn who_is_faster_towards_the_other_walks_into_the_other() {
        let speeds = [(Some(1), 0.5, 0.4), (Some(1), 0.3, 0.4), (Some(1), -0.1, 0.4), (None, 0.2, 0.0)];
        let contact =
            |(person, robot_mps, person_mps)| Contact { time_s: 1.0, person, robot_mps, person_mps };
        let row = Row { contacts: speeds.map(contact).to_vec(), ..row("a", "b", 1) };
        let expected = Blame { walls: 1, robot: 1, person: 1, run_down: 1 };
        assert_eq!(Blame::of(std::iter::once(&row)), expected);
    }

    #[test]
    fn a_run_with_a_collision_arrived_but_is_no_success() {
        let mut rows = [row("a", "b", 1), row("a", "b", 2), row("a", "b", 3)];
        rows[0].measures.collisions = 3;
        rows[2].outcome = Outcome::Lost;
        let tally = Tally::of(rows.iter());
        assert_eq!((tally.runs, tally.success, tally.reached, tally.lost), (3, 1, 2, 1));
        assert_eq!((tally.collided, tally.contacts), (1, 3));
        assert_eq!((tally.cycles, tally.first_choices), (3 * 83, 3 * 70));
        assert_eq!((tally.other_free, tally.only_slow, tally.none_free, tally.untold), (3 * 10, 0, 3 * 3, 0));
        rows[1].cycles.other_choice = BTreeMap::from([("no_candidates".into(), 9)]);
        let tally = Tally::of(rows.iter());
        assert_eq!((tally.no_candidates, tally.untold), (9, 4));
    }
}
