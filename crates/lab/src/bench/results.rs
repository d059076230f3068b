//! The files that a bench writes.

use std::collections::BTreeSet;

use super::measure::Measure;
use super::row::Row;
use curionav_deployment::csv_row::csv_row;

/// The reason codes of cycles that did not follow the first choice, and their columns.
const NOT_FIRST: [(&str, &str); 4] = [
    ("other_free", "least_cost_free"),
    ("only_slow", "only_slow_free"),
    ("none_free", "none_free"),
    ("no_candidates", "no_candidates"),
];

/// The columns of a planner of one's own: what checks what it proposes, and how often it failed.
const OWN_PLANNER: [&str; 5] = ["check", "late", "errors", "refused", "deaths"];

pub(super) fn files(rows: &[&Row]) -> [(&'static str, String); 4] {
    [
        ("results.csv", results(rows)),
        ("social.csv", social(rows)),
        ("collisions.csv", collisions(rows)),
        ("timings.csv", timings(rows)),
    ]
}

/// A row per run, with what does not depend on the clock: the same bytes for the same program, scenarios, profiles and
/// seeds. Only a planner of one's own that is late makes a difference.
fn results(rows: &[&Row]) -> String {
    let labels = ["scenario", "planner", "seed", "outcome"];
    let measures = Measure::ALL.map(Measure::key);
    let columns = ["cycles", "first_choice"].into_iter().chain(NOT_FIRST.map(|(column, _)| column));
    let columns = columns.chain(["degraded", "decisions_sha256"]).chain(OWN_PLANNER);
    let mut text = csv_row(labels.into_iter().chain(measures).chain(columns));
    for row in rows {
        let outcome: &str = row.outcome.into();
        let labels = [row.scenario.clone(), row.planner.clone(), row.seed.to_string(), outcome.into()];
        let last = [row.cycles.count, row.cycles.first_choice].map(|n| n.to_string()).into_iter();
        let last = last.chain(NOT_FIRST.map(|(_, code)| decided(row, code)));
        let last = last.chain([row.cycles.degraded.to_string(), row.decisions_sha256.clone()]);
        let last = last.chain(own_planner(row));
        text += &csv_row(labels.into_iter().chain(Measure::ALL.map(|m| number(m, row))).chain(last));
    }
    text
}

/// What the columns of a planner of one's own say; nothing of a profile. Only the first says something for sure of a
/// planner that was late: how often it was depends on the clock.
fn own_planner(row: &Row) -> [String; 5] {
    let Some(own) = &row.own_planner else { return Default::default() };
    let [late, errors, refused, deaths] =
        [own.late, own.errors, own.refused, own.deaths].map(|count| count.to_string());
    [own.check.word().to_owned(), late, errors, refused, deaths]
}

/// In how many cycles the reason of the decision had this code; nothing for a run of an older build, which does not say
/// it of every cycle.
fn decided(row: &Row, code: &str) -> String {
    let others = &row.cycles.other_choice;
    let told = row.cycles.first_choice + others.values().sum::<u64>();
    if told < row.cycles.count {
        return String::new();
    }
    others.get(code).copied().unwrap_or_default().to_string()
}

/// A row per run with all measures of social navigation, in the order of their names; nothing where a run has none.
fn social(rows: &[&Row]) -> String {
    let names: BTreeSet<&str> = rows.iter().flat_map(|row| row.social.keys().map(String::as_str)).collect();
    let mut text = csv_row(["scenario", "planner", "seed"].into_iter().chain(names.iter().copied()));
    for row in rows {
        let labels = [row.scenario.clone(), row.planner.clone(), row.seed.to_string()];
        let numbers =
            names.iter().map(|name| row.social.get(*name).copied().map_or_else(String::new, decimal));
        text += &csv_row(labels.into_iter().chain(numbers));
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
    fn social_measures_have_a_column_each_and_none_is_made_up() {
        let with = |social: &[(&str, f64)]| Row {
            social: social.iter().map(|(name, value)| ((*name).to_owned(), *value)).collect(),
            ..row("a", "b", 1)
        };
        let first = with(&[("spl", 0.5), ("jerk_avg_mps3", 1.0)]);
        let second = with(&[("spl", 1.0), ("overlaps_moving_ahead", 2.0)]);
        let text = social(&[&first, &second]);
        let lines: Vec<&str> = text.lines().collect();
        let names = "scenario,planner,seed,jerk_avg_mps3,overlaps_moving_ahead,spl";
        assert_eq!(lines, [names, "a,b,1,1,,0.5", "a,b,1,,2,1"]);
    }

    #[test]
    fn a_run_is_one_record_and_no_time_of_the_clock_is_in_the_results() {
        let slow = Row { wall_s: 99.0, real_time_factor: 1.0, ..row("a", "b", 1) };
        let text = results(&[&row("a", "b", 1)]);
        assert_eq!(text, results(&[&slow]));
        assert_ne!(timings(&[&row("a", "b", 1)]), timings(&[&slow]));
        let fields: Vec<usize> = text.lines().map(|line| line.split(',').count()).collect();
        assert_eq!(fields, [35, 35]);
        assert!(text.lines().nth(1).is_some_and(|l| l.starts_with("a,b,1,reached,1,0.12,0.05,1,")), "{text}");
    }
}
