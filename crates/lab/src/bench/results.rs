//! The files that a bench writes.

use super::findings::Findings;
use super::measure::Measure;
use super::report::report;
use super::row::{Row, Tally};
use super::summary::summary;
use curionav_deployment::csv_row::csv_row;

pub(super) fn files(bench: &Findings<'_>, rows: &[&Row]) -> anyhow::Result<[(&'static str, String); 5]> {
    Ok([
        ("results.csv", results(rows)),
        ("collisions.csv", collisions(rows)),
        ("timings.csv", timings(rows)),
        ("summary.json", serde_json::to_string_pretty(&summary(bench))? + "\n"),
        ("report.html", report(bench)?),
    ])
}

/// A row per run, with what does not depend on the clock: the same bytes for the same program, scenarios, profiles and
/// seeds.
fn results(rows: &[&Row]) -> String {
    let labels = ["scenario", "planner", "seed", "outcome"];
    let measures = Measure::ALL.map(Measure::key);
    let columns = ["cycles", "first_choice"].into_iter().chain(Tally::NOT_FIRST);
    let columns = columns.chain(["degraded", "decisions_sha256"]);
    let mut text = csv_row(labels.into_iter().chain(measures).chain(columns));
    for row in rows {
        let outcome: &str = row.outcome.into();
        let labels = [row.scenario.clone(), row.planner.clone(), row.seed.to_string(), outcome.into()];
        let tally = Tally::of(std::iter::once(*row));
        let last = [tally.cycles, tally.first_choices].map(|n| n.to_string()).into_iter();
        let last = last.chain(tally.not_first().map_or_else(Default::default, |n| n.map(|n| n.to_string())));
        let last = last.chain([row.cycles.degraded.to_string(), row.decisions_sha256.clone()]);
        text += &csv_row(labels.into_iter().chain(Measure::ALL.map(|m| number(m, row))).chain(last));
    }
    text
}

/// A row per collision: how fast robot and person came towards each other; without a person's id it was a wall.
fn collisions(rows: &[&Row]) -> String {
    let mut text = csv_row(["scenario", "planner", "seed", "time_s", "person", "robot_mps", "person_mps"]);
    for row in rows {
        for contact in &row.contacts {
            let labels = [row.scenario.clone(), row.planner.clone(), row.seed.to_string()];
            let person = contact.person.map_or_else(String::new, |id| id.to_string());
            let numbers = [contact.robot_mps, contact.person_mps].map(decimal);
            text += &csv_row(labels.into_iter().chain([decimal(contact.time_s), person]).chain(numbers));
        }
    }
    text
}

fn timings(rows: &[&Row]) -> String {
    let mut text =
        csv_row(["scenario", "planner", "seed", "real_time_factor", "wall_s", "p50_ms", "p99_ms", "max_ms"]);
    for row in rows {
        let labels = [row.scenario.clone(), row.planner.clone(), row.seed.to_string()];
        let times =
            [row.real_time_factor, row.wall_s, row.cycles.p50_ms, row.cycles.p99_ms, row.cycles.max_ms];
        text += &csv_row(labels.into_iter().chain(times.map(decimal)));
    }
    text
}

/// Every run's own value, also the length of a journey that did not reach its goal.
fn number(measure: Measure, row: &Row) -> String {
    let m = &row.measures;
    match measure {
        Measure::Length => decimal(m.length_m),
        Measure::Time => decimal(m.time_s),
        _ => measure.of(row).map_or_else(String::new, decimal),
    }
}

/// To nine decimals: farther ones are no more than the rounding of sums.
fn decimal(value: f64) -> String {
    ((value * 1e9).round() / 1e9).to_string()
}

#[cfg(test)]
mod tests {
    use super::super::row::tests::row;
    use super::*;

    #[test]
    fn collisions_are_told_one_by_one() {
        let text = collisions(&[&row("a", "b", 1)]);
        let lines: Vec<&str> = text.lines().skip(1).collect();
        assert_eq!(lines, ["a,b,1,3.5,7,-0.25,1.25", "a,b,1,9,,0.5,0"]);
    }

    #[test]
    fn a_run_is_one_record_and_no_time_of_the_clock_is_in_the_results() {
        let slow = Row { wall_s: 99.0, real_time_factor: 1.0, ..row("a", "b", 1) };
        let text = results(&[&row("a", "b", 1)]);
        assert_eq!(text, results(&[&slow]));
        assert_ne!(timings(&[&row("a", "b", 1)]), timings(&[&slow]));
        let fields: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(fields, [29, 29]);
        assert!(text.lines().nth(1).is_some_and(|l| l.starts_with("a,b,1,reached,1,0.12,0.05,1,")), "{text}");
    }
}
