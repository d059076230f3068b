//! The result of a run as a table for people, at most 80 columns wide.

use comfy_table::{CellAlignment, ContentArrangement, Table};
use curionav_schemas::{Contact, Cycles, Outcome, RunResult};

/// Columns of the narrowest terminal the table is made for.
const WIDTH: u16 = 80;
/// Collisions that are shown; metrics.json has all.
const CONTACTS_SHOWN: usize = 5;
/// Digits of the decisions' digest that are shown: enough to tell two runs apart.
const DIGEST_SHOWN: usize = 12;

pub(crate) fn table(result: &RunResult) -> String {
    let mut table = Table::new();
    table
        .load_style(comfy_table::presets::UTF8_BORDERS_ONLY)
        .set_content_arrangement(ContentArrangement::Dynamic)
        .set_width(WIDTH)
        .set_header(["measure", "value", "meaning"]);
    for (name, value, meaning) in rows(result) {
        table.add_row([name, value, meaning]);
    }
    if let Some(column) = table.column_mut(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    format!("{}\n{}", headline(result), table.trim_fmt())
}

fn headline(result: &RunResult) -> String {
    let RunResult { scenario, planner, seed, measures, .. } = result;
    let bumps = match measures.collisions {
        0 => "without collision".to_owned(),
        1 => "with 1 collision".to_owned(),
        many => format!("with {many} collisions"),
    };
    let outcome = match result.outcome {
        Outcome::Reached => "REACHED the goal",
        Outcome::Timeout => "TIMEOUT before the goal",
        Outcome::Lost => "LOST on the map",
        Outcome::NoWay => "NO WAY to the goal is open",
    };
    format!("{outcome} {bumps}: {scenario}, planner {planner}, seed {seed}")
}

fn rows(result: &RunResult) -> Vec<(String, String, String)> {
    let m = &result.measures;
    let c = &result.cycles;
    let digest = result.decisions_sha256.get(..DIGEST_SHOWN).unwrap_or(&result.decisions_sha256);
    let mut rows = vec![
        row("time", format!("{:.1} s", m.time_s), "from start to end"),
        row("length", metres(m.length_m), "way driven"),
        row("VEL", format!("{:.2} m/s", m.vel_mps), "mean speed"),
        row("collisions", m.collisions.to_string(), "contacts while driving"),
        row("clearance", metres(m.clearance_min_m), "least gap to a wall or person"),
        row("RMSE", format!("{:.3} m", m.rmse_m), "error of the estimated position"),
        row("TCM", per_cent(m.tcm), "of the run, until localisation was certain"),
        row(
            "NM",
            m.nm.map_or_else(|| "never converged".into(), |n| n.to_string()),
            "times localisation was lost again",
        ),
        row(
            "TCE",
            m.tce_s.map_or_else(|| "never".into(), |s| format!("{s:.1} s")),
            "until the error stayed below 0.3 m",
        ),
        row("TD", per_cent(m.td), "of the time closer to people than comfortable"),
        row("TD in view", m.td_in_view.map_or_else(String::new, per_cent), "of people that no wall hides"),
        row("MD", m.md_m.map_or_else(|| "no people".into(), metres), "least distance to a person's centre"),
        row(
            "MD in view",
            m.md_in_view_m.map_or_else(|| "nobody".into(), metres),
            "of people that no wall hides",
        ),
        row("NT", m.nt.to_string(), "times it came that close from farther away"),
        row(
            "cycle time",
            format!("{:.1} ms", c.p50_ms),
            &format!("p99 {:.1} ms, max {:.1} ms", c.p99_ms, c.max_ms),
        ),
        row("speed-up", format!("{:.1} x", result.real_time_factor), "simulated over wall time"),
        row("decisions", digest.to_owned(), "SHA-256; in lockstep the same for the same run"),
        row("cycles", c.count.to_string(), "decisions taken"),
    ];
    rows.extend(shares(c));
    rows.extend(result.contacts.iter().take(CONTACTS_SHOWN).map(contact));
    rows
}

/// A collision, with the speeds at which robot and person came towards each other.
fn contact(c: &Contact) -> (String, String, String) {
    let name = format!("hit at {:.1} s", c.time_s);
    let [robot, person] = [c.robot_mps, c.person_mps].map(|speed| format!("{speed:.2} m/s"));
    match c.person {
        None => row(&name, robot, "robot to a wall"),
        Some(id) => row(&name, robot, &format!("robot to person {id}, who came at {person}")),
    }
}

/// How many of the cycles were as they should be, and what the others had to do without.
fn shares(c: &Cycles) -> Vec<(String, String, String)> {
    let in_time = share(c.count.saturating_sub(c.late), c.count + c.skipped);
    let missed = format!("of the cycles due; {} skipped, {} late", c.skipped, c.late);
    let by_code = c
        .degraded_by
        .iter()
        .map(|(code, count)| row("", share(*count, c.count), &format!("- {}", code.replace('_', " "))));
    let degraded =
        if c.degraded == 0 { "of the decisions" } else { "of the decisions, by what was missing:" };
    let decided = [
        row("first choice", share(c.first_choice, c.count), "of the decisions: what it wanted most"),
        row("in time", in_time, &missed),
        row("degraded", share(c.degraded, c.count), degraded),
    ];
    decided.into_iter().chain(by_code).collect()
}

fn row(name: &str, value: String, meaning: &str) -> (String, String, String) {
    (name.to_owned(), value, meaning.to_owned())
}

fn metres(length: f64) -> String {
    format!("{length:.2} m")
}

fn share(part: u64, all: u64) -> String {
    per_cent(part as f64 / all.max(1) as f64)
}

fn per_cent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    #[test]
    fn a_table_fits_into_80_columns_and_begins_with_the_outcome() {
        let text = table(&golden::run_result());
        assert!(text.starts_with("REACHED the goal without collision"), "{text}");
        for line in text.lines() {
            assert!(line.chars().count() <= usize::from(WIDTH), "{} columns: {line}", line.chars().count());
        }
    }

    #[test]
    fn every_row_is_one_line() {
        let result = golden::run_result();
        // Around the rows stand the headline, the header and three rules.
        assert_eq!(table(&result).lines().count(), rows(&result).len() + 5);
    }

    #[test]
    fn shares_are_of_the_cycles_that_were_due_and_of_the_decisions() {
        let mut cycles = golden::run_result().cycles;
        let values = |cycles: &Cycles| -> Vec<String> {
            shares(cycles)
                .into_iter()
                .map(|(name, value, meaning)| format!("{name} {value} {meaning}"))
                .collect()
        };
        // 83 decisions, 1 late, of 85 that were due: 82 / 85. 70 / 83 first choice, 1 / 83 degraded.
        let expected = [
            "first choice 84.3 % of the decisions: what it wanted most",
            "in time 96.5 % of the cycles due; 2 skipped, 1 late",
            "degraded 1.2 % of the decisions, by what was missing:",
            " 1.2 % - cut short",
            " 1.2 % - evaluated locally",
        ];
        assert_eq!(values(&cycles), expected);
        cycles = Cycles { count: 0, skipped: 0, late: 0, first_choice: 0, degraded: 0, ..cycles };
        cycles.degraded_by.clear();
        let expected = [
            "first choice 0.0 % of the decisions: what it wanted most",
            "in time 0.0 % of the cycles due; 0 skipped, 0 late",
            "degraded 0.0 % of the decisions",
        ];
        assert_eq!(values(&cycles), expected);
    }

    #[test]
    fn a_run_without_people_says_so() {
        let mut result = golden::run_result();
        result.measures.md_m = None;
        result.measures.collisions = 2;
        let text = table(&result);
        assert!(text.contains("no people") && text.contains("with 2 collisions"), "{text}");
    }
}
