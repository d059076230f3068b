//! Every mean with its interval.

use super::super::findings::Findings;
use super::super::measure::Measure;
use super::html::{escaped, planner, table, td, th};

pub(super) fn spreads(bench: &Findings<'_>) -> String {
    let comparison = &bench.comparison;
    let head: String = Measure::ALL.iter().map(|m| th(m.label())).collect();
    let mut rows = Vec::new();
    for (s, scenario) in comparison.scenarios.iter().enumerate() {
        for (p, name) in comparison.planners.iter().enumerate() {
            let cells: String = Measure::ALL.iter().map(|m| cell(bench, *m, s, p)).collect();
            let scenario = if p == 0 { escaped(scenario) } else { String::new() };
            rows.push(td("", &scenario) + &td("words", &planner(name, p)) + &cells);
        }
    }
    let head = [th("scenario") + "<th class=\"words\">planner</th>" + &head];
    format!(
        "<h2 class=\"page\">Means with their 95 % intervals</h2>\n<p>Percentile bootstrap of the mean over the seeds. Length and Time: of \
         the runs that reached the goal.</p>\n{}",
        table("dense", &head, &rows)
    )
}

fn cell(bench: &Findings<'_>, measure: Measure, scenario: usize, planner: usize) -> String {
    let Some(spread) = bench.comparison.spread(measure, scenario, planner) else { return td("", "\u{2013}") };
    let [mean, low, high] = [spread.mean, spread.low, spread.high].map(|v| measure.show(v));
    td("", &format!("{mean} <span class=\"sd\">[{low}, {high}]</span>"))
}
