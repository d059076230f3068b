use super::*;
use curionav_schemas::{CycleReport, OccupancyGrid, RunResult};
use curionav_testing::golden;
use svg::node::element::tag::Type;
use svg::parser::Event;

fn picture(result: &RunResult, reports: &[CycleReport]) -> String {
    picture_on(&golden::occupancy_grid(), result, reports)
}

fn picture_on(map: &OccupancyGrid, result: &RunResult, reports: &[CycleReport]) -> String {
    run_svg(&Run {
        result,
        reports,
        map,
        truth: None,
        things: &[],
        goal: (8.0, 6.5),
        robot_radius: 0.3,
        goal_tolerance: 0.5,
    })
}

/// A run along the x axis with every column that is drawn.
fn run(rows: u32) -> RunResult {
    let columns =
        ["time_s", "true_x", "true_y", "true_heading", "belief_x", "belief_y", "cov_xx", "cov_xy", "cov_yy"];
    let columns = columns.iter().chain(&["cov_hh", "v", "person_distance"]);
    let mut result = golden::run_result();
    result.trace.columns = columns.map(ToString::to_string).collect();
    result.trace.values = (0..rows)
        .flat_map(|row| {
            let t = 0.1 * f64::from(row);
            [t, t, 0.0, 0.0, t + 0.1, 0.1, 0.04, 0.01, 0.05, 0.01, 1.0, if row < 5 { 1e3 } else { 2.0 }]
        })
        .collect();
    result.trace.rows = rows;
    result.trace.people.rows = 0;
    result
}

fn count(svg: &str, what: &str) -> usize {
    svg.matches(what).count()
}

/// Every element that is opened is closed, in the right order, and nothing follows the root.
fn assert_well_formed(svg: &str) {
    let mut open: Vec<String> = Vec::new();
    let mut roots = 0;
    for event in svg::read(svg).unwrap() {
        match event {
            Event::Tag(name, Type::Start, _) => {
                roots += usize::from(open.is_empty());
                open.push(name.to_owned());
            }
            Event::Tag(name, Type::End, _) => assert_eq!(open.pop().as_deref(), Some(name)),
            Event::Error(error) => panic!("{error}"),
            _ => {}
        }
    }
    assert!(open.is_empty(), "left open: {open:?}");
    assert_eq!(roots, 1);
}

#[test]
fn the_picture_is_well_formed_and_needs_nothing_else() {
    let svg = picture(&run(60), &[golden::cycle_report()]);
    assert_well_formed(&svg);
    // The namespace is a name, not an address.
    assert_eq!(count(&svg, "http"), count(&svg, r#"xmlns="http://www.w3.org/2000/svg""#));
}

#[test]
fn every_candidate_of_a_moment_is_one_line_and_one_is_chosen() {
    let mut reports = vec![golden::cycle_report(); 3];
    for (report, stamp) in reports.iter_mut().zip([0.0, 3.0, 5.0]) {
        report.scene.stamp = stamp;
    }
    let svg = picture(&run(60), &reports);
    assert_eq!(count(&svg, r#"class="snapshot""#), 3);
    assert_eq!(count(&svg, r#"<polyline class="candidate""#), 3);
    assert_eq!(count(&svg, r#"<polyline class="rejected""#), 3);
    assert_eq!(count(&svg, r#"class="line chosen""#), 3);
}

#[test]
fn zones_are_drawn_and_explained_where_there_are_any() {
    let reports = [golden::cycle_report()];
    let zoned = picture_on(&golden::zoned_occupancy_grid(), &run(60), &reports);
    assert_well_formed(&zoned);
    // On the whole map and in the one cycle that is shown.
    assert_eq!((count(&zoned, r##"href="#zones""##), count(&zoned, "keepout, and slow floor")), (2, 1));
    assert!(!picture(&run(60), &reports).contains("zones"));
}

#[test]
fn a_stop_chooses_nothing() {
    let stopped = CycleReport { decision: golden::stop(), chosen: None, ..golden::cycle_report() };
    let svg = picture(&run(60), &[stopped]);
    assert_eq!(count(&svg, r#"class="line chosen""#), 0);
    assert!(svg.contains(": no scored candidate is free"));
}

#[test]
fn what_is_missing_is_left_out() {
    assert_well_formed(&picture(&golden::run_result(), &[]));
    assert_well_formed(&picture(&run(0), &[golden::cycle_report()]));
    assert_well_formed(&picture(&run(1), &[]));
}

#[test]
fn no_number_is_missing_or_infinite() {
    for rows in [0, 1, 60] {
        let svg = picture(&run(rows), &[golden::cycle_report()]);
        assert!(!svg.contains("NaN") && !svg.contains("inf\"") && !svg.contains("inf "));
    }
}

#[test]
fn names_cannot_break_the_picture() {
    let mut result = run(60);
    result.scenario = "</text><script>\u{1}&amp;\"".into();
    let svg = picture(&result, &[]);
    assert_well_formed(&svg);
    assert!(!svg.contains("<script>") && !svg.contains('\u{1}'));
}

#[test]
fn the_same_run_gives_the_same_bytes() {
    let reports = [golden::cycle_report()];
    assert_eq!(picture(&run(60), &reports), picture(&run(60), &reports));
}
