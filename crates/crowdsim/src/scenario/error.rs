//! What is wrong with a scenario, where, and how to mend it.

use std::fmt;
use std::ops::Range;

use toml::de::{DeTable, DeValue};

/// One fault of a scenario: line and field if known, the problem and its mend.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct ScenarioError {
    /// Line in the file, from 1; none when the scenario did not come from a file.
    pub line: Option<usize>,
    /// Path of the field, such as `walkers[2].route[0]`; empty for the file as a whole.
    pub field: String,
    /// What is wrong.
    pub problem: String,
    /// What to do about it.
    pub mend: String,
}

impl fmt::Display for ScenarioError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(line) = self.line {
            write!(f, "line {line}: ")?;
        }
        if !self.field.is_empty() {
            write!(f, "{}: ", self.field)?;
        }
        write!(f, "{}; {}", self.problem, self.mend)
    }
}

impl ScenarioError {
    /// A fault of a field, with its mend; the line is not known yet.
    pub fn new(field: impl Into<String>, problem: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { line: None, field: field.into(), problem: problem.into(), mend: mend.into() }
    }

    /// The same error with the line of its field in `text`, the file the scenario was read from.
    #[must_use]
    pub fn located_in(mut self, text: &str) -> Self {
        self.line = field_line(text, &self.field);
        self
    }

    /// From what the TOML reader says: it knows the place, the document tells the field.
    pub(super) fn from_syntax(error: &toml::de::Error, text: &str) -> Self {
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
            field,
            problem,
            mend: mend_for(error.message()).to_owned(),
        }
    }
}

fn mend_for(message: &str) -> &'static str {
    if message.starts_with("unknown field") {
        "correct the spelling or remove it"
    } else if message.starts_with("missing field") {
        "add it"
    } else if message.starts_with("invalid") || message.starts_with("unknown variant") {
        "give a value of the expected kind"
    } else {
        "correct the TOML"
    }
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
fn path_at(table: &DeTable<'_>, at: &Range<usize>) -> String {
    let holds = |span: &Range<usize>| span.start <= at.start && at.end <= span.end;
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
fn path_in(value: &DeValue<'_>, at: &Range<usize>) -> Option<String> {
    let holds = |span: &Range<usize>| span.start <= at.start && at.end <= span.end;
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
