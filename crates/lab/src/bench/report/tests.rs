use std::time::Duration;

use super::super::claims::Judged;
use super::super::comparison::Comparison;
use super::super::comparison::tests::{names, rows};
use super::super::row::Row;
use super::*;

fn page(planners: &[&str]) -> String {
    let rows = rows("env2-s2", planners, |p, seed| 0.1 * p as f64 + 0.001 * seed as f64);
    let all: Vec<&Row> = rows.iter().collect();
    let comparison = Comparison::new(names(planners), names(&["env2-s2"]), &all);
    let bench = Findings {
        claims: vec![Judged { claim: "`a` wins".into(), holds: false, found: "it <did> not".into() }],
        densities: None,
        comparison,
        planners: &[],
        scenes: &[],
        jobs: &[],
        missing: &[],
        programs: vec!["abc".into()],
        first_seed: 1,
        repeats: 10,
        workers: 2,
        clock: Duration::from_secs(90),
    };
    report(&bench).unwrap()
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
    assert!(page.contains("Table V") && page.contains("seeds 1 to 10") && page.contains("30 runs"));
    for tag in ["table", "tr", "td", "th", "p", "h2"] {
        let opened = page.matches(&format!("<{tag}>")).count() + page.matches(&format!("<{tag} ")).count();
        assert_eq!(opened, page.matches(&format!("</{tag}>")).count(), "{tag}");
    }
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
