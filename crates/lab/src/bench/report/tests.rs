use std::time::Duration;

use super::super::claims::Judged;
use super::super::comparison::Comparison;
use super::super::comparison::tests::{names, rows};
use super::super::row::Row;
use super::*;
use curionav_schemas::Outcome;

fn page(planners: &[&str]) -> String {
    let rows = rows("env2-s2", planners, |p, seed| 0.1 * p as f64 + 0.001 * seed as f64);
    let all: Vec<&Row> = rows.iter().collect();
    report(&findings(Comparison::new(names(planners), names(&["env2-s2"]), vec![0], &all))).unwrap()
}

fn findings(comparison: Comparison<'_>) -> Findings<'_> {
    Findings {
        claims: vec![Judged {
            claim: "`a` wins".into(),
            about: "TD (%)".into(),
            found: "it <did> not".into(),
            ..Judged::default()
        }],
        densities: None,
        comparison,
        planners: &[],
        scenes: &[],
        jobs: &[],
        missing: &[],
        programs: vec!["abc".into()],
        first_seed: 1,
        perception: Some("tracked"),
        repeats: 10,
        workers: 2,
        clock: Duration::from_secs(90),
    }
}

#[test]
fn the_page_needs_nothing_else_and_marks_the_papers_slips() {
    let page = page(&["curiosity", "cpc-only", "cnc-only"]);
    assert!(!page.contains("<script") && !page.contains("<link") && !page.contains("src="));
    // 35.00 m of the paper cannot be.
    assert!(page.contains("35.00\u{b1}0.96<sup>a</sup>") && page.contains("above the robot's top speed"));
    assert!(page.starts_with("<!DOCTYPE html>\n") && page.ends_with("</html>\n"));
    assert!(
        page.contains("0 of 1 hold")
            && page.contains("<code>a</code> wins")
            && page.contains("&#60;did&#62;")
    );
    assert!(page.contains("How people are known: tracked."));
    assert!(page.contains("Table V") && page.contains("seeds 1 to 10") && page.contains("30 runs"));
    for tag in ["table", "tr", "td", "th", "p", "h2"] {
        let opened = page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count();
        assert_eq!(opened, page.matches(&format!("</{tag}>")).count(), "{tag}");
    }
}

#[test]
fn scenes_are_told_apart_by_kind_where_there_are_several() {
    let planners = ["a", "b"];
    let scenes = ["door-1", "door-2", "hall-1"];
    let mut runs: Vec<Row> = scenes.iter().flat_map(|scene| rows(scene, &planners, |_, _| 0.1)).collect();
    runs.iter_mut().filter(|run| run.scenario == "door-2").for_each(|run| run.outcome = Outcome::Timeout);
    let all: Vec<&Row> = runs.iter().collect();
    let page =
        report(&findings(Comparison::new(names(&planners), names(&scenes), vec![0, 0, 1], &all))).unwrap();
    let cells = |done: &str, failed: &str| format!(r#"<td>{done}</td><td class="sd">{failed}</td>"#);
    let row = cells("10 of 20", "10, 0, 0") + &cells("10 of 10", "0, 0, 0");
    assert_eq!(page.matches(&row).count(), 2, "{page}");
    assert!(!page.contains("in the paper</h2>"));
    assert!(!self::page(&planners).contains("By kind of scene"));
}

#[test]
fn the_first_lines_say_how_it_went_and_how_far_that_reaches() {
    let planners = ["curiosity", "cpc-only", "distance-only"];
    let scenes = ["void-1", "room-1", "room-2"];
    // Everything ends well but for `curiosity` in eight of ten runs in the void and in one of a room.
    let mut runs: Vec<Row> =
        scenes.iter().flat_map(|s| rows(s, &planners, |p, _| 0.2 - 0.1 * p as f64)).collect();
    let fails = |row: &Row| match row.scenario.as_str() {
        "void-1" => row.seed > 2,
        "room-1" => row.seed == 1,
        _ => false,
    };
    runs.iter_mut().filter(|row| row.planner == "curiosity" && fails(row)).for_each(|row| {
        row.outcome = Outcome::Timeout;
    });
    runs.iter_mut().for_each(|row| row.measures.time_s = if row.planner == "cpc-only" { 30.0 } else { 40.0 });
    let all: Vec<&Row> = runs.iter().collect();
    let findings = findings(Comparison::new(names(&planners), names(&scenes), vec![0, 1, 2], &all));
    let expected = [
        "`curiosity` reached the goal without a collision in 21 of 30 runs (95 %, if runs were independent: 52 to 83 %). Of the \
         other 2 planners, 2 did so more often and 0 as often; the most is 30 of `cpc-only`. By the paired tests below, with p < \
         0.01, it can be told from chance for 0 of them, and with so few places that differ no result could be.",
        "Of its 9 failures, 8 are in scenes of the kind void, where it has 2 of 10 runs and the others 10 (`cpc-only`) to 10 \
         (`cpc-only`). Without these, its worst, it has 19 of 20, and 2 of the others have more.",
        "In pairs of runs in which both arrived, 1 of the others took less time than it on the mean (0 with p < 0.01); `cpc-only` \
         arrived 10.0 s sooner (21 pairs, mean over 3 places).",
        "It was nearer than 1.5 m to people for 8.0 s per run (mean of all runs, also of those that failed); 2 of the others for \
         less, and the least of the others is 0.0 s (`distance-only`).",
        "Of 1 claim written down before, 0 hold: 0 of 1 about TD (%) of the run.",
        "All scenes are in 3 places. That is too few to show anything for other places, however many runs there are: all of \
         this holds for these places.",
    ];
    assert_eq!(short::sentences(&Page::new(&findings)), expected);
}

#[test]
fn the_papers_order_is_on_the_first_page() {
    let page = page(&["curiosity", "cpc-only", "cnc-only"]);
    let first = page.split("How the runs ended").next().unwrap();
    assert!(first.contains("TD 3 of 3"), "{first}");
}

#[test]
fn names_cannot_break_the_page() {
    let page = page(&["<img src=x>", "b&c"]);
    assert!(!page.contains("<img") && page.contains("b&#38;c"));
}

#[test]
fn one_planner_alone_is_a_page_too() {
    assert!(page(&["curiosity"]).contains("Table III"));
}
