//! Candidates and their costs as a table.

use comfy_table::{CellAlignment, Table};
use curionav_schemas::{CycleReport, TermReport};

use super::words::name;

/// The `top` best candidates (0: all): those not rejected first, each kind by cost. The chosen one is always there.
pub(super) fn table(report: &CycleReport, top: usize) -> Table {
    let scored: Vec<&TermReport> = report.terms.iter().filter(|term| !term.raw.is_empty()).collect();
    let mut header = vec!["candidate".to_owned(), "cost".to_owned()];
    for term in &scored {
        header.push(term.metric.clone());
        header.push(format!("{} raw", term.metric));
    }
    header.push(String::new());
    let mut table = Table::new();
    table.load_style(comfy_table::presets::UTF8_BORDERS_ONLY).set_header(header);
    for index in order(report, top) {
        table.add_row(row(report, &scored, index));
    }
    for column in 0..2 + 2 * scored.len() {
        if let Some(column) = table.column_mut(column) {
            column.set_cell_alignment(CellAlignment::Right);
        }
    }
    table
}

fn order(report: &CycleReport, top: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..report.candidates.count as usize).collect();
    let chosen = report.chosen.map(|chosen| chosen as usize);
    order.sort_by(|&a, &b| {
        let key = |i: usize| (chosen != Some(i), !report.rejected[i].is_empty(), unscored(report, i));
        key(a).cmp(&key(b)).then(report.total[a].total_cmp(&report.total[b])).then(a.cmp(&b))
    });
    if top > 0 {
        order.truncate(top);
    }
    order
}

fn unscored(report: &CycleReport, index: usize) -> bool {
    report.terms.iter().any(|term| term.missing.contains(&(index as u32)))
}

fn row(report: &CycleReport, scored: &[&TermReport], index: usize) -> Vec<String> {
    let known = |term: &TermReport| !term.missing.contains(&(index as u32));
    let total = if unscored(report, index) { String::new() } else { format!("{:.4}", report.total[index]) };
    let mut row = vec![name(report, index as u32), total];
    for term in scored {
        let cost = term.cost.get(index).filter(|_| known(term));
        row.push(cost.map_or(String::new(), |cost| format!("{cost:.4}")));
        row.push(if known(term) { format!("{:.4}", term.raw[index]) } else { String::new() });
    }
    row.push(remark(report, index));
    row
}

/// Chosen, next, or why not.
fn remark(report: &CycleReport, index: usize) -> String {
    match Some(index as u32) {
        at if at == report.chosen => "chosen".to_owned(),
        at if at == report.runner_up => "next".to_owned(),
        _ => report.rejected[index].clone(),
    }
}

#[cfg(test)]
mod tests {
    use curionav_schemas::golden;

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
