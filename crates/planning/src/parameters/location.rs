//! Where in a TOML text a parameter stands.

use std::ops;

use toml::de::{DeTable, DeValue};

use super::error::{FieldError, range_of};
use super::field::Field;

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
        let mut field = DeTable::parse(text).map(|t| path_at(t.get_ref(), &at)).unwrap_or_default();
        if let Some(name) = problem.strip_prefix("missing field `").and_then(|rest| rest.split('`').next()) {
            if !field.is_empty() {
                field.push('.');
            }
            field.push_str(name);
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
    let document = DeTable::parse(text).ok()?;
    let mut value = &DeValue::Table(document.get_ref().clone());
    let mut line = None;
    for segment in field.split(['.', '[']).filter(|s| !s.is_empty()) {
        let next = match segment.strip_suffix(']') {
            Some(index) => index.parse::<usize>().ok().and_then(|i| value.get(i)).map(|v| (v, v.span())),
            None => value
                .as_table()
                .and_then(|t| t.iter().find(|(key, _)| key.get_ref() == segment))
                .map(|(key, v)| (v, key.span())),
        };
        let Some((inner, span)) = next else { break };
        line = Some(line_of(text, span.start));
        value = inner.get_ref();
    }
    line
}

/// Path of the innermost field whose key or value holds the place `at`.
fn path_at(table: &DeTable<'_>, at: &ops::Range<usize>) -> String {
    let holds = |span: &ops::Range<usize>| span.start <= at.start && at.end <= span.end;
    for (key, value) in table {
        let name = key.get_ref().as_ref();
        if holds(&key.span()) {
            return name.to_owned();
        }
        if let Some(inner) = path_in(value.get_ref(), at) {
            let separator = if inner.is_empty() || inner.starts_with('[') { "" } else { "." };
            return format!("{name}{separator}{inner}");
        }
        if holds(&value.span()) {
            return name.to_owned();
        }
    }
    String::new()
}

/// As [`path_at`], below a value; none when the place is not inside anything it contains.
fn path_in(value: &DeValue<'_>, at: &ops::Range<usize>) -> Option<String> {
    let holds = |span: &ops::Range<usize>| span.start <= at.start && at.end <= span.end;
    match value {
        DeValue::Table(table) => Some(path_at(table, at)).filter(|p| !p.is_empty()),
        DeValue::Array(items) => items.iter().enumerate().find_map(|(i, item)| {
            let inner = path_in(item.get_ref(), at);
            match inner {
                Some(inner) => {
                    let separator = if inner.is_empty() || inner.starts_with('[') { "" } else { "." };
                    Some(format!("[{i}]{separator}{inner}"))
                }
                None => holds(&item.span()).then(|| format!("[{i}]")),
            }
        }),
        _ => None,
    }
}
