//! The figures for people.

use comfy_table::{CellAlignment, Table};

use super::break_even::{BreakEven, Row as BreakEvenRow};
use super::fleet::Row as FleetRow;
use super::overhead::{Overhead, Question, ROUND_TRIPS_MAX};
use super::throughput::Row as ThroughputRow;

fn table(header: &[&str], rows: impl Iterator<Item = Vec<String>>) -> String {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::UTF8_BORDERS_ONLY).set_header(header);
    for row in rows {
        table.add_row(row);
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.trim_fmt()
}

fn per_cent(share: f64) -> String {
    format!("{:.1} %", 100.0 * share)
}

pub(super) fn throughput(rows: &[ThroughputRow]) -> String {
    let header = ["replicas", "candidates/s", "p50 ms", "p99 ms", "efficiency", "cores", "asking"];
    let line = |row: &ThroughputRow| {
        vec![
            row.replicas.to_string(),
            format!("{:.0}", row.candidates_per_s),
            format!("{:.2}", row.p50_ms),
            format!("{:.2}", row.p99_ms),
            format!("{:.3}", row.efficiency),
            format!("{:.2}", row.cores),
            format!("{:.2}", row.asking_cores),
        ]
    };
    table(&header, rows.iter().map(line))
}

pub(super) fn break_even(rows: &[BreakEvenRow], even: &[BreakEven]) -> String {
    let header = ["replicas", "people", "batch", "in process ms", "pool ms", "pool / in process"];
    let line = |row: &BreakEvenRow| {
        vec![
            row.replicas.to_string(),
            row.people.to_string(),
            row.batch.to_string(),
            format!("{:.3}", row.in_process_ms),
            format!("{:.3}", row.pool_ms),
            format!("{:.2}", row.pool_ms / row.in_process_ms),
        ]
    };
    let mut text = table(&header, rows.iter().map(line));
    for b in even {
        let from = match b.batch {
            Some(batch) => format!("asking is faster from batches of {batch} on"),
            None => "asking is never faster".to_owned(),
        };
        text += &format!("\n{} replicas, {} people: {from}", b.replicas, b.people);
    }
    text
}

pub(super) fn fleet(rows: &[FleetRow]) -> String {
    let header = [
        "replicas",
        "robots",
        "cycles",
        "p50 ms",
        "p99 ms",
        "budget ms",
        "unanswered",
        "skipped",
        "fairness",
        "cores",
        "asking",
    ];
    let line = |row: &FleetRow| {
        vec![
            row.replicas.to_string(),
            row.robots.to_string(),
            row.cycles.to_string(),
            format!("{:.2}", row.p50_ms),
            format!("{:.2}", row.p99_ms),
            format!("{:.0}", row.budget_ms),
            per_cent(row.unanswered),
            per_cent(row.skipped),
            format!("{:.4}", row.fairness),
            format!("{:.2}", row.cores),
            format!("{:.2}", row.asking_cores),
        ]
    };
    table(&header, rows.iter().map(line))
}

pub(super) fn overhead(o: &Overhead) -> String {
    let header = ["question", "asked with", "answered with", "bare p50"];
    let line = |q: &Question| {
        vec![
            q.question.clone(),
            format!("{} bytes", q.question_bytes),
            format!("{} bytes", q.answer_bytes),
            format!("{:.3} ms", q.p50_ms),
        ]
    };
    let questions = table(&header, o.questions.iter().map(line));
    let verdict = if o.round_trips <= ROUND_TRIPS_MAX { "within" } else { "beyond" };
    let header = ["home", "generate", "evaluate", "decide", "cycle p50"];
    let homes = [("in process", &o.in_process), ("processes", &o.processes)].map(|(home, s)| {
        let ms = [s.generate_ms, s.evaluate_ms, s.decide_ms, s.cycle_ms].map(|ms| format!("{ms:.3} ms"));
        [vec![home.to_owned()], ms.to_vec()].concat()
    });
    let homes = table(&header, homes.into_iter());
    format!(
        "{questions}\n{homes}\n{} cycles in either home\n\
         the split adds {:.2} bare round trips of {:.3} ms, {verdict} the {ROUND_TRIPS_MAX} allowed",
        o.cycles, o.round_trips, o.bare_p50_ms,
    )
}
