//! Reading parameter structs from TOML, and where in the text a parameter stands.

use std::ops;

use serde::de::DeserializeOwned;
use toml::Spanned;
use toml::de::{DeTable, DeValue};

use super::error::{FieldError, range_of};
use super::field::Field;
use super::ranged::Ranged;
use crate::text::without_mark;

/// Reads and checks a file. Errors name line and field.
pub fn read<T: Ranged + DeserializeOwned>(text: &str) -> Result<T, FieldError> {
    let text = without_mark(text);
    let value: T = toml::from_str(text).map_err(|e| FieldError::from_syntax(&e, text, T::FIELDS))?;
    value.check().map_err(|e| e.located_in(text))?;
    Ok(value)
}

/// Reads and checks a table that has been part of a file. Errors name the field, by its path within the table.
pub fn read_table<T: Ranged + DeserializeOwned>(table: &toml::Table) -> Result<T, FieldError> {
    // Only a text tells where a value of the wrong kind is.
    read(&table.to_string()).map_err(|e| FieldError { line: None, ..e })
}

impl FieldError {
    /// The same error with the line of its field in `text`, the file the scenario was read from.
    #[must_use]
    pub fn located_in(mut self, text: &str) -> Self {
        self.line = field_line(text, &self.field);
        self
    }

    /// From what the TOML reader says: it knows the place, the document tells the field, and `fields` its range.
    pub fn from_syntax(error: &toml::de::Error, text: &str, fields: &[Field]) -> Self {
        let problem = error.message().replace('\n', ", ");
        let at = error.span().unwrap_or(0..0);
        let holds = |place: &Place| place.span.start <= at.start && at.end <= place.span.end;
        let mut field = places(text).into_iter().rfind(holds).map_or(String::new(), |place| place.field);
        if let Some(name) = problem.strip_prefix("missing field `").and_then(|rest| rest.split('`').next()) {
            field = if field.is_empty() { name.to_owned() } else { format!("{field}.{name}") };
        }
        Self {
            line: Some(line_of(text, at.start)),
            mend: mend_for(error.message(), &field, fields),
            field,
            problem,
        }
    }
}

fn mend_for(message: &str, field: &str, fields: &[Field]) -> String {
    if message.starts_with("unknown field") {
        return "correct the spelling or remove it".into();
    } else if message.starts_with("missing field") {
        return "add it".into();
    } else if !(message.starts_with("invalid") || message.starts_with("unknown variant")) {
        return "correct the TOML".into();
    }
    range_of(field, fields).map_or_else(|| "give a value of the expected kind".into(), |range| range.mend())
}

fn line_of(text: &str, byte: usize) -> usize {
    1 + text.bytes().take(byte).filter(|&b| b == b'\n').count()
}

/// Line, from 1, of the field with this path in a TOML text, or of its nearest ancestor that is there.
pub fn field_line(text: &str, field: &str) -> Option<usize> {
    let leads_to = |place: &Place| {
        field.strip_prefix(&place.field).is_some_and(|rest| rest.is_empty() || rest.starts_with(['.', '[']))
    };
    let deepest = places(text).into_iter().filter(leads_to).reduce(|deepest, place| {
        // A key stands before its value.
        if place.field.len() > deepest.field.len() { place } else { deepest }
    })?;
    Some(line_of(text, deepest.span.start))
}

/// A key or a value, by the path of its field.
struct Place {
    field: String,
    span: ops::Range<usize>,
}

/// All of a TOML text, every table and list before what it contains; none if it is not TOML.
fn places(text: &str) -> Vec<Place> {
    let mut places = Vec::new();
    if let Ok(document) = DeTable::parse(text) {
        add_table(document.get_ref(), "", &mut places);
    }
    places
}

fn add_table(table: &DeTable<'_>, path: &str, places: &mut Vec<Place>) {
    for (key, value) in table {
        let separator = if path.is_empty() { "" } else { "." };
        let field = format!("{path}{separator}{}", key.get_ref());
        places.push(Place { field: field.clone(), span: key.span() });
        add_value(value, &field, places);
    }
}

fn add_value(value: &Spanned<DeValue<'_>>, path: &str, places: &mut Vec<Place>) {
    places.push(Place { field: path.to_owned(), span: value.span() });
    match value.get_ref() {
        DeValue::Table(table) => add_table(table, path, places),
        DeValue::Array(items) => {
            items.iter().enumerate().for_each(|(i, item)| add_value(item, &format!("{path}[{i}]"), places));
        }
        _ => {}
    }
}
