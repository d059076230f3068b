//! Candidates and their costs as a table.

use comfy_table::{CellAlignment, Table};
use curionav_schemas::words::say;
use curionav_schemas::{CycleReport, TermReport};

use super::words::name;

/// The `top` best candidates (0: all): those not rejected first, each kind by cost. The chosen one is always there.
pub(super) fn table(report: &CycleReport, top: usize) -> Table {
    let scored: Vec<&TermReport> = report.terms.iter().filter(|term| !term.scored.is_empty()).collect();
    let mut header = vec!["candidate".to_owned(), "cost".to_owned()];
    for term in &scored {
        header.push(term.term.clone());
        header.push(format!("{} raw", term.term));
    }
    header.push(String::new());
    let mut table = Table::new();
    table.load_style(comfy_table::presets::UTF8_BORDERS_ONLY).set_header(header);
    for index in order(report, top) {
        table.add_row(row(report, &scored, index));
    }
    for column in table.column_iter_mut().take(2 + 2 * scored.len()) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn order(report: &CycleReport, top: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..report.candidates.count as usize).collect();
    let chosen = report.chosen.map(|chosen| chosen as usize);
    let costs: Vec<f64> = order.iter().map(|i| report.total_of(*i).unwrap_or(f64::INFINITY)).collect();
    // Both sorts are stable.
    order.sort_by(|a, b| costs[*a].total_cmp(&costs[*b]));
    order.sort_by_key(|i| (chosen != Some(*i), report.rejection_of(*i).is_some()));
    if top > 0 {
        order.truncate(top);
    }
    order
}

fn row(report: &CycleReport, scored: &[&TermReport], index: usize) -> Vec<String> {
    let mut row = vec![name(report, index as u32), cell(report.total_of(index))];
    for term in scored {
        row.extend([cell(term.cost_of(index)), cell(term.raw_of(index))]);
    }
    row.push(remark(report, index));
    row
}

/// A cost; an empty cell if there is none.
fn cell(cost: Option<f64>) -> String {
    cost.map_or(String::new(), |cost| format!("{cost:.4}"))
}

fn remark(report: &CycleReport, index: usize) -> String {
    match Some(index as u32) {
        at if at == report.chosen => "chosen".to_owned(),
        at if at == report.runner_up => "next".to_owned(),
        _ => report.rejection_of(index).map(|why| say("rejection", why)).unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use curionav_testing::golden;

    use super::*;

    #[test]
    fn the_chosen_one_leads_and_the_rejected_come_last() {
        let report = golden::explained_cycle_report();
        let rows = |top| {
            let text = table(&report, top).to_string();
            let names = text.lines().filter_map(|line| line.split_whitespace().nth(1)?.parse::<u32>().ok());
            names.collect::<Vec<_>>()
        };
        assert_eq!(rows(0), [9, 12, 4]);
        assert_eq!(rows(2), [9, 12]);
        let text = table(&report, 0).to_string();
        assert!(text.contains("not scored by `cpc`") && text.contains("next"), "{text}");
    }
}
