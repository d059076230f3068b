//! Checking the numbers of parameter structs.

use std::collections::BTreeMap;

use super::error::FieldError;
use super::field::{Field, Kind, Range, number as written};

/// What has fields with ranges.
pub trait Ranged {
    /// The fields, in the order of declaration.
    const FIELDS: &'static [Field];

    /// The first fault, by its path from here and with its mend.
    fn check(&self) -> Result<(), FieldError>;

    /// How many tables there are, for a list of them.
    fn entries(&self) -> Option<usize> {
        None
    }
}

impl<T: Ranged> Ranged for Vec<T> {
    const FIELDS: &'static [Field] = T::FIELDS;

    fn check(&self) -> Result<(), FieldError> {
        let one = |(i, entry): (usize, &T)| entry.check().map_err(|e| e.below(&format!("[{i}]")));
        self.iter().enumerate().try_for_each(one)
    }

    fn entries(&self) -> Option<usize> {
        Some(self.len())
    }
}

impl<T: Ranged> Ranged for Option<T> {
    const FIELDS: &'static [Field] = T::FIELDS;

    fn check(&self) -> Result<(), FieldError> {
        self.as_ref().map_or(Ok(()), Ranged::check)
    }
}

impl<T: Ranged> Ranged for BTreeMap<String, T> {
    const FIELDS: &'static [Field] = T::FIELDS;

    fn check(&self) -> Result<(), FieldError> {
        self.iter().try_for_each(|(name, entry)| entry.check().map_err(|e| e.below(name)))
    }

    fn entries(&self) -> Option<usize> {
        Some(self.len())
    }
}

/// One number or several.
pub trait Numbers {
    /// The first number that `ranges` do not allow: its place, such as `[2][0]`, and its range. The ranges apply in
    /// turn to the numbers of a list; `at` is the place of a number in its list.
    fn fault(&self, ranges: &[Range], at: usize) -> Option<(String, f64, Range)>;

    /// How many there are, for a list.
    fn entries(&self) -> Option<usize> {
        None
    }
}

macro_rules! single {
    ($($ty:ty),*) => {$(
        impl Numbers for $ty {
            fn fault(&self, ranges: &[Range], at: usize) -> Option<(String, f64, Range)> {
                let number = *self as f64;
                let range = ranges[at % ranges.len()];
                (!range.holds(number)).then(|| (String::new(), number, range))
            }
        }
    )*};
}
single!(f64, u32, usize);

impl<T: Numbers> Numbers for Option<T> {
    fn fault(&self, ranges: &[Range], at: usize) -> Option<(String, f64, Range)> {
        self.as_ref()?.fault(ranges, at)
    }

    fn entries(&self) -> Option<usize> {
        self.as_ref().and_then(Numbers::entries)
    }
}

impl<T: Numbers, const N: usize> Numbers for [T; N] {
    fn fault(&self, ranges: &[Range], _: usize) -> Option<(String, f64, Range)> {
        first_fault(self, ranges)
    }
}

impl<T: Numbers> Numbers for Vec<T> {
    fn fault(&self, ranges: &[Range], _: usize) -> Option<(String, f64, Range)> {
        first_fault(self, ranges)
    }

    fn entries(&self) -> Option<usize> {
        Some(self.len())
    }
}

fn first_fault<T: Numbers>(list: &[T], ranges: &[Range]) -> Option<(String, f64, Range)> {
    list.iter().enumerate().find_map(|(i, value)| {
        let (place, number, range) = value.fault(ranges, i)?;
        Some((format!("[{i}]{place}"), number, range))
    })
}

/// Checks the text of one field, which names something.
pub fn check_name(text: &str, field: &Field, mend: &str) -> Result<(), FieldError> {
    if text.is_empty() { Err(FieldError::new(field.name, "is empty", mend)) } else { Ok(()) }
}

/// Checks the numbers of one field.
pub fn check_numbers<T: Numbers>(value: &T, field: &Field) -> Result<(), FieldError> {
    let Kind::Numbers(ranges, entries) = field.kind else { return Ok(()) };
    check_entries(value.entries(), field.name, entries)?;
    let Some((place, number, range)) = value.fault(ranges, 0) else { return Ok(()) };
    let problem = format!("is {}", written(number));
    Err(FieldError::new(format!("{}{place}", field.name), problem, range.mend()))
}

/// Checks the table, or the tables, of one field.
pub fn check_table<T: Ranged>(value: &T, field: &Field) -> Result<(), FieldError> {
    if let Kind::Table(_, entries) = field.kind {
        check_entries(value.entries(), field.name, entries)?;
    }
    value.check().map_err(|e| e.below(field.name))
}

fn check_entries(found: Option<usize>, field: &str, allowed: Option<Range>) -> Result<(), FieldError> {
    match (found, allowed) {
        (Some(found), Some(allowed)) if !allowed.holds(found as f64) => {
            Err(FieldError::new(field, format!("has {found} entries"), allowed.mend()))
        }
        _ => Ok(()),
    }
}
