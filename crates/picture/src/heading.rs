//! The title: which run, how it ended, how well.

use super::page::{Panel, rectangle};
use super::palette::{BELIEF, GOAL};
use super::symbols::text;
use curionav_schemas::{Outcome, RunResult};
use svg::node::element::{Group, TSpan};

/// Two lines and a row of figures, `width` pixels wide.
pub(super) fn heading(result: &RunResult, width: f64) -> Panel {
    let (verdict, colour) = verdict(result);
    let of = format!("planner {} \u{b7} seed {}", result.planner, result.seed);
    let ended = text((0.0, 45.0), "h2", "")
        .add(TSpan::new(verdict).set("style", format!("fill:{colour}")))
        .add(TSpan::new(of).set("dx", 14).set("style", "font-weight:normal"));
    let mut content = Group::new().add(text((0.0, 20.0), "h1", result.scenario.clone())).add(ended);
    let figures = figures(result);
    let each = width / figures.len() as f64;
    content = content.add(rectangle(width, 42.0, "#f4f4f2").set("y", 58).set("rx", 4));
    for (index, (name, value)) in figures.into_iter().enumerate() {
        let x = each * (index as f64 + 0.5);
        content = content
            .add(text((x, 74.0), "s", name).set("text-anchor", "middle"))
            .add(text((x, 91.0), "b", value).set("text-anchor", "middle").set("style", "font-size:13px"));
    }
    Panel { content, width, height: 100.0 }
}

fn verdict(result: &RunResult) -> (String, &'static str) {
    let ended = match result.outcome {
        Outcome::Reached => "Goal reached",
        Outcome::Timeout => "Out of time",
        Outcome::Lost => "Lost on the map",
        Outcome::NoWay => "No way to the goal",
    };
    let colour =
        if result.outcome == Outcome::Reached && result.measures.collisions == 0 { GOAL } else { BELIEF };
    let collisions = match result.measures.collisions {
        0 => String::new(),
        1 => ", 1 collision".to_owned(),
        many => format!(", {many} collisions"),
    };
    (format!("{ended}{collisions}"), colour)
}

fn figures(result: &RunResult) -> [(&'static str, String); 12] {
    let m = &result.measures;
    [
        ("time", format!("{:.1} s", m.time_s)),
        ("length", format!("{:.1} m", m.length_m)),
        ("mean speed", format!("{:.2} m/s", m.vel_mps)),
        ("RMSE", format!("{:.2} m", m.rmse_m)),
        ("TCM", format!("{:.1} %", 100.0 * m.tcm)),
        ("NM", or_dash(m.nm.map(|n| n.to_string()))),
        ("TCE", or_dash(m.tce_s.map(|s| format!("{s:.1} s")))),
        ("TD", format!("{:.1} %", 100.0 * m.td)),
        ("MD", or_dash(m.md_m.map(|md| format!("{md:.2} m")))),
        ("NT", m.nt.to_string()),
        ("least gap", format!("{:.2} m", m.clearance_min_m)),
        ("cycle p99", format!("{:.1} ms", result.cycles.p99_ms)),
    ]
}

fn or_dash(figure: Option<String>) -> String {
    figure.unwrap_or_else(|| "\u{2013}".to_owned())
}
