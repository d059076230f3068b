//! `report.html`: one file that needs nothing else, on screen and on paper.

mod figures;
mod html;
mod order;
mod overview;
mod published_tables;
mod spreads;
mod tests_table;

use super::findings::Findings;
use crate::plural::count;

/// The page.
pub(super) fn report(bench: &Findings<'_>) -> String {
    let title = format!(
        "{} in {}: {} runs",
        count(bench.comparison.planners.len(), "planner"),
        count(bench.comparison.scenarios.len(), "scenario"),
        bench.runs()
    );
    let body = [
        overview::heading(bench, &title),
        overview::acceptance(bench),
        overview::outcomes(bench),
        published_tables::tables(bench),
        tests_table::tests(bench),
        order::order(bench),
        figures::figures(bench),
        spreads::spreads(bench),
    ]
    .concat();
    format!(
        "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
         <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
         <title>curionav bench: {}</title>\n<style>\n{}{}\n</style>\n</head>\n<body>\n{body}</body>\n</html>\n",
        html::escaped(&title),
        include_str!("style.css"),
        curionav_picture::style_sheet(),
    )
}

#[cfg(test)]
mod tests;
