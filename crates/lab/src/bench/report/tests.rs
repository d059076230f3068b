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
            holds: false,
            too_few: false,
            found: "it <did> not".into(),
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
fn names_cannot_break_the_page() {
    let page = page(&["<img src=x>", "b&c"]);
    assert!(!page.contains("<img") && page.contains("b&#38;c"));
}

#[test]
fn one_planner_alone_is_a_page_too() {
    assert!(page(&["curiosity"]).contains("Table III"));
}
