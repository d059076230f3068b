//! Whether the planners come in the paper's order.

use super::super::comparison::Order;
use super::super::findings::Findings;
use super::super::measure::Measure;
use super::html::{escaped, table, td, th};

pub(super) fn order(bench: &Findings<'_>) -> String {
    let comparison = &bench.comparison;
    let all = 0..comparison.scenarios.len();
    if !all.clone().any(|s| Measure::PAPER.iter().any(|m| comparison.order(*m, s).pairs > 0)) {
        return String::new();
    }
    let head: String = Measure::PAPER.iter().map(|m| th(m.label())).collect();
    let mut rows: Vec<String> = all
        .clone()
        .map(|s| {
            let cells = Measure::PAPER.iter().map(|m| cell(comparison.order(*m, s)));
            td("", &escaped(&comparison.scenarios[s])) + &cells.collect::<String>()
        })
        .collect();
    let total = |measure: &Measure| {
        let sum = |a: Order, b: Order| Order { agree: a.agree + b.agree, pairs: a.pairs + b.pairs };
        cell(all.clone().map(|s| comparison.order(*measure, s)).fold(Order { agree: 0, pairs: 0 }, sum))
    };
    rows.push(td("", "<b>all</b>") + &Measure::PAPER.iter().map(total).collect::<String>());
    format!(
        "<section class=\"keep\">\n<h2>The paper's order</h2>\n<p>Of the pairs of planners whose means differ in the paper's tables, how many \
         are in the same order here; a tie here is not. Half of them would be by chance.</p>\n{}</section>\n",
        table("", &[th("scenario") + &head], &rows)
    )
}

fn cell(order: Order) -> String {
    if order.pairs == 0 {
        return td("not-judged", "\u{2013}");
    }
    let share = order.agree as f64 / order.pairs as f64;
    let class = if share >= 0.75 {
        "pass"
    } else if share < 0.5 {
        "miss"
    } else {
        ""
    };
    td(class, &format!("{} of {}", order.agree, order.pairs))
}
