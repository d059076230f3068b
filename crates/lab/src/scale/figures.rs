//! What is measured, row by row: for scripts as JSON, for people as a table.

use comfy_table::{CellAlignment, Table};
use serde_json::{Map, Value};

/// One figure: its key in JSON (empty if it is only for people), its column, and its value in both forms.
pub(super) struct Figure {
    key: &'static str,
    column: &'static str,
    value: Value,
    shown: String,
}

/// A number of something; the column has the name of the key.
pub(super) fn count(key: &'static str, number: usize) -> Figure {
    Figure { key, column: key, value: number.into(), shown: number.to_string() }
}

/// A number that is shown with so many decimals.
pub(super) fn number(key: &'static str, column: &'static str, value: f64, decimals: usize) -> Figure {
    Figure { key, column, value: value.into(), shown: format!("{value:.decimals$}") }
}

/// A share that is shown in per cent; the column has the name of the key.
pub(super) fn share(key: &'static str, share: f64) -> Figure {
    Figure { key, column: key, value: share.into(), shown: format!("{:.1} %", 100.0 * share) }
}

pub(super) fn label(key: &'static str, column: &'static str, name: &str) -> Figure {
    Figure { key, column, value: name.into(), shown: name.to_owned() }
}

/// The figures of one row; every row of a table has the same.
pub(super) type Row = Vec<Figure>;

pub(super) fn json(row: &Row) -> Value {
    let keyed = row.iter().filter(|figure| !figure.key.is_empty());
    Value::Object(keyed.map(|figure| (figure.key.to_owned(), figure.value.clone())).collect::<Map<_, _>>())
}

/// Rows of many figures: one line per figure, one column per row.
pub(super) fn upright(rows: &[Row]) -> String {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::UTF8_BORDERS_ONLY);
    let figures = rows.iter().map(Vec::len).max().unwrap_or_default();
    for index in 0..figures {
        let of_figure = || rows.iter().filter_map(|row| row.get(index));
        let name = of_figure().next().map(|figure| figure.column.to_owned());
        table.add_row(name.into_iter().chain(of_figure().map(|figure| figure.shown.clone())));
    }
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.trim_fmt()
}

pub(super) fn table(rows: &[Row]) -> String {
    let mut table = Table::new();
    let header = rows.first().into_iter().flatten().map(|figure| figure.column);
    table.load_style(comfy_table::presets::UTF8_BORDERS_ONLY).set_header(header);
    for row in rows {
        table.add_row(row.iter().map(|figure| &figure.shown));
    }
    for column in table.column_iter_mut() {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table.trim_fmt()
}
