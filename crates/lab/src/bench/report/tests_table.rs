//! Planners against the first one, pair by pair, over all scenarios.

use super::super::acceptance::shown_p;
use super::super::findings::Findings;
use super::super::measure::Measure;
use super::html::{escaped, planner, table, td, th};

/// A difference is coloured below this p.
const SIGNIFICANT: f64 = 0.01;

pub(super) fn tests(bench: &Findings<'_>) -> String {
    let comparison = &bench.comparison;
    let Some((first, others)) = comparison.planners.split_first().filter(|(_, others)| !others.is_empty())
    else {
        return String::new();
    };
    let names: String = (others.iter().enumerate())
        .map(|(p, name)| format!("<th class=\"first\">{}</th>", planner(name, p + 1)))
        .collect();
    let rows: Vec<String> = Measure::ALL
        .iter()
        .map(|measure| {
            let cells: String = (1..=others.len()).map(|p| cell(bench, *measure, p)).collect();
            td("", measure.label()) + &cells
        })
        .collect();
    format!(
        "<h2 class=\"page\">Paired tests over all scenarios</h2>\n<p>Mean difference, the other planner minus {}, in the same scenario \
         with the same seed; its 95 % bootstrap interval; p of Wilcoxon's signed-rank test, two-sided (differences of zero \
         left out, ties at their mean rank). Green: {} is better with p &lt; {SIGNIFICANT}; red: worse. The tests are \
         not corrected for their number. All pairs of planners, also scenario by scenario, are in summary.json.</p>\n{}",
        planner(first, 0),
        super::html::escaped(first),
        table("", &[th("measure") + &names], &rows)
    )
}

fn cell(bench: &Findings<'_>, measure: Measure, other: usize) -> String {
    let Some(paired) = bench.comparison.paired(measure, other, 0, None) else {
        return td("first", "\u{2013}");
    };
    let class = match (paired.p < SIGNIFICANT, measure.prefers(0.0, paired.difference)) {
        (false, _) => "first",
        (true, true) => "first pass",
        (true, false) => "first miss",
    };
    let [difference, low, high] = [paired.difference, paired.low, paired.high].map(|v| measure.show(v));
    let p = escaped(&shown_p(paired.p));
    td(
        class,
        &format!(
            "<b>{difference}</b> [{low}, {high}]<br><span class=\"sd\">{p}, n = {}</span>",
            paired.pairs
        ),
    )
}
