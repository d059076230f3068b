//! Checking the numbers of parameter structs.

use std::collections::BTreeMap;

use super::error::FieldError;
use super::field::{Field, Kind};
use super::range::{Range, number as written};

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
    /// Calls `visit` with every number and its place: no index for a number alone.
    fn each(&self, visit: &mut dyn FnMut(&[usize], f64));

    /// How many there are, for a list.
    fn entries(&self) -> Option<usize> {
        None
    }
}

macro_rules! single {
    ($($ty:ty),*) => {$(
        impl Numbers for $ty {
            fn each(&self, visit: &mut dyn FnMut(&[usize], f64)) {
                visit(&[], *self as f64);
            }
        }
    )*};
}
single!(f64, u32, usize);

impl<T: Numbers> Numbers for Option<T> {
    fn each(&self, visit: &mut dyn FnMut(&[usize], f64)) {
        self.iter().for_each(|value| value.each(visit));
    }

    fn entries(&self) -> Option<usize> {
        self.as_ref().and_then(Numbers::entries)
    }
}

impl<T: Numbers> Numbers for [T] {
    fn each(&self, visit: &mut dyn FnMut(&[usize], f64)) {
        for (i, value) in self.iter().enumerate() {
            value.each(&mut |place, number| visit(&[&[i], place].concat(), number));
        }
    }
}

impl<T: Numbers, const N: usize> Numbers for [T; N] {
    fn each(&self, visit: &mut dyn FnMut(&[usize], f64)) {
        self.as_slice().each(visit);
    }
}

impl<T: Numbers> Numbers for Vec<T> {
    fn each(&self, visit: &mut dyn FnMut(&[usize], f64)) {
        self.as_slice().each(visit);
    }

    fn entries(&self) -> Option<usize> {
        Some(self.len())
    }
}

/// Checks the numbers of one field.
pub fn check_numbers<T: Numbers>(value: &T, field: &Field) -> Result<(), FieldError> {
    let Kind::Numbers(ranges, entries) = field.kind else { return Ok(()) };
    check_entries(value.entries(), field.name, entries)?;
    let mut fault = None;
    value.each(&mut |place, number| {
        let range = &ranges[place.last().map_or(0, |k| k % ranges.len())];
        if !range.holds(number) && fault.is_none() {
            let place: String = place.iter().map(|k| format!("[{k}]")).collect();
            let problem = format!("is {}", written(number));
            fault = Some(FieldError::new(format!("{}{place}", field.name), problem, range.mend()));
        }
    });
    fault.map_or(Ok(()), Err)
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
