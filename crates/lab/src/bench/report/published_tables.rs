//! Tables III, IV and V beside what the paper prints.

use std::collections::BTreeSet;

use super::super::findings::Findings;
use super::super::measure::{Better, Measure};
use super::super::published::{Slip, published};
use super::html::{escaped, planner, table, td, th};

const TITLES: [&str; 3] = ["Table III: localisation", "Table IV: human awareness", "Table V: efficiency"];

pub(super) fn tables(bench: &Findings<'_>) -> String {
    let mut text = "<h2 class=\"page\">Tables III to V, here and in the paper</h2>\n\
        <p>Upper line of a cell: mean \u{b1} standard deviation of the runs here, the best mean of a row underlined. \
        Lower line: what the paper prints. Its scenes and people are not published, so orders and ratios compare, \
        values hardly do.</p>\n"
        .to_owned();
    for (title, measures) in TITLES.iter().zip(Measure::PAPER.chunks(3)) {
        text += &format!("<section class=\"keep\">\n<h3>{title}</h3>\n{}</section>\n", one(bench, measures));
    }
    text
}

fn one(bench: &Findings<'_>, measures: &[Measure]) -> String {
    let comparison = &bench.comparison;
    let groups: String = (comparison.planners.iter().enumerate())
        .map(|(p, name)| format!("<th class=\"group first\" colspan=\"3\">{}</th>", planner(name, p)))
        .collect();
    let arrow = |m: &Measure| if m.better() == Better::Lower { "\u{2193}" } else { "\u{2191}" };
    let names: String = (comparison.planners.iter())
        .flat_map(|_| measures.iter().enumerate())
        .map(|(i, m)| {
            let class = if i == 0 { " class=\"first\"" } else { "" };
            format!("<th{class}>{} {}</th>", m.label(), arrow(m))
        })
        .collect();
    let mut slips = BTreeSet::new();
    let rows: Vec<String> = (comparison.scenarios.iter().enumerate())
        .map(|(s, scenario)| {
            let mut row = td("", &escaped(scenario));
            for (p, name) in comparison.planners.iter().enumerate() {
                for (i, measure) in measures.iter().enumerate() {
                    slips.extend(published(*measure, name, scenario).and_then(|theirs| theirs.slip));
                    row += &cell(bench, *measure, s, p, i == 0);
                }
            }
            row
        })
        .collect();
    let notes: String = Slip::ALL
        .iter()
        .filter(|slip| slips.contains(slip))
        .map(|slip| format!("<sup>{}</sup> {}. ", slip.mark(), escaped(slip.words())))
        .collect();
    let mut remarks = String::new();
    if measures.contains(&Measure::Tcm) {
        remarks += "TCM is a share of the run: one that ends only with its time has a small share before convergence. ";
    }
    if measures.contains(&Measure::Td) {
        remarks +=
            "The paper's text calls its CNC worse than its CPC; for TD that holds in 9 of its 13 scenarios. ";
    }
    if measures.contains(&Measure::Length) {
        remarks += "Length and Time here: of the runs that reached the goal. ";
    }
    let head = [format!("<th></th>{groups}"), th("scenario") + &names];
    format!("{}<p class=\"notes\">{remarks}{notes}</p>\n", table("dense", &head, &rows))
}

fn cell(bench: &Findings<'_>, measure: Measure, scenario: usize, planner: usize, is_first: bool) -> String {
    let comparison = &bench.comparison;
    let own = comparison.spread(measure, scenario, planner).map_or_else(
        || "\u{2013}".to_owned(),
        |spread| {
            let (mean, sd) = (measure.show(spread.mean), measure.show(spread.sd));
            let sd = if spread.runs > 1 { format!("\u{b1}{sd}") } else { String::new() };
            format!("<span class=\"own\">{mean}</span><span class=\"sd\">{sd}</span>")
        },
    );
    let names = (&comparison.planners[planner], &comparison.scenarios[scenario]);
    let theirs = published(measure, names.0, names.1).map_or_else(String::new, |theirs| {
        let is_whole = matches!(measure, Measure::Nm | Measure::Nt);
        let mean = if is_whole { format!("{:.0}", theirs.mean) } else { measure.show(theirs.mean) };
        let sd = theirs.sd.map_or_else(String::new, |sd| format!("\u{b1}{}", measure.show(sd)));
        let mark = theirs.slip.map_or_else(String::new, |slip| format!("<sup>{}</sup>", slip.mark()));
        format!("<span class=\"paper\">{mean}{sd}{mark}</span>")
    });
    let best = if comparison.is_best(measure, scenario, planner) { "best" } else { "" };
    let first = if is_first { "first" } else { "" };
    td(format!("{best} {first}").trim(), &(own + &theirs))
}
