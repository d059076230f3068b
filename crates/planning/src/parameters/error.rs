//! What is wrong with a parameter, where it stands, and how to mend it.

use std::fmt;

use super::field::{Field, Kind, Range};

/// One fault of a file or table: line and field if known, the problem and its mend.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub struct FieldError {
    /// Line in the file, from 1; none when the scenario did not come from a file.
    pub line: Option<usize>,
    /// Path of the field, such as `walkers[2].route[0]`; empty for the file as a whole.
    pub field: String,
    /// What is wrong.
    pub problem: String,
    /// What to do about it.
    pub mend: String,
}

impl fmt::Display for FieldError {
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

impl FieldError {
    /// A fault of a field, with its mend; the line is not known yet.
    pub fn new(field: impl Into<String>, problem: impl Into<String>, mend: impl Into<String>) -> Self {
        Self { line: None, field: field.into(), problem: problem.into(), mend: mend.into() }
    }

    /// The same error seen from the table `outer`, or the entry `[i]` of a list, that the field is in.
    #[must_use]
    pub fn below(mut self, outer: &str) -> Self {
        let separator = if self.field.is_empty() || self.field.starts_with('[') { "" } else { "." };
        self.field = format!("{outer}{separator}{}", self.field);
        self
    }
}

/// The range of the number at this path, such as `robot.start[2]`, if one is declared.
pub fn range_of(path: &str, fields: &[Field]) -> Option<Range> {
    let Kind::Numbers(ranges, _) = kind(path, fields)? else { return None };
    let last = path.strip_suffix(']').and_then(|path| path.rsplit('[').next()?.parse::<usize>().ok());
    Some(ranges[last.unwrap_or(0) % ranges.len()])
}

/// What the field with this path holds, if it is known.
fn kind(path: &str, fields: &[Field]) -> Option<Kind> {
    let (first, rest) = path.split_once('.').unwrap_or((path, ""));
    let name = first.split('[').next().unwrap_or_default();
    match fields.iter().find(|f| f.name == name).map(|f| f.kind)? {
        Kind::Table(inner, _) if !rest.is_empty() => {
            // An entry of a map is named by the file, not by a field.
            kind(rest, inner).or_else(|| kind(rest.split_once('.')?.1, inner))
        }
        found => Some(found),
    }
}
