//! The checks every message is built from. Each names the field it refuses.

use crate::array::{F32Array, F64Array};
use crate::limits::{MAX_LIST, MAX_MAGNITUDE, MAX_STEPS, MAX_TEXT};
use crate::message::Validate;
use crate::names::check_id;
use crate::reject::{Refusal, Reject, cut};
use ciborium::Value;

/// Refuses a number that is not finite or larger than anything physical.
pub(crate) fn number(field: &str, value: f64) -> Result<(), Reject> {
    // A NaN is not within the bound either.
    if value.abs() <= MAX_MAGNITUDE {
        return Ok(());
    }
    Err(Refusal::NotFinite.at(field))
}

/// [`number`] for several fields.
pub(crate) fn numbers(fields: &[(&str, f64)]) -> Result<(), Reject> {
    fields.iter().try_for_each(|(field, value)| number(field, *value))
}

/// [`number`] for a field that may be absent.
pub(crate) fn optional(field: &str, value: Option<f64>) -> Result<(), Reject> {
    value.map_or(Ok(()), |value| number(field, value))
}

/// Numbers greater than zero.
pub(crate) fn positive(fields: &[(&str, f64)]) -> Result<(), Reject> {
    numbers(fields)?;
    match fields.iter().find(|(_, value)| *value <= 0.0) {
        Some((field, value)) => Err(Refusal::NotPositive { found: *value }.at(*field)),
        None => Ok(()),
    }
}

/// Numbers of zero or more.
pub(crate) fn non_negative(fields: &[(&str, f64)]) -> Result<(), Reject> {
    fields.iter().try_for_each(|(field, value)| within(field, *value, 0.0, MAX_MAGNITUDE))
}

/// A number from `least` to `most`.
pub(crate) fn within(field: &str, value: f64, least: f64, most: f64) -> Result<(), Reject> {
    number(field, value)?;
    if (least..=most).contains(&value) {
        return Ok(());
    }
    Err(Refusal::OutOfRange { found: value, least, most }.at(field))
}

/// A number from zero to one.
pub(crate) fn fraction(field: &str, value: f64) -> Result<(), Reject> {
    within(field, value, 0.0, 1.0)
}

/// A length or count of `limit` at most.
pub(crate) fn at_most(field: &str, found: usize, limit: usize) -> Result<(), Reject> {
    if found <= limit {
        return Ok(());
    }
    Err(Refusal::TooMany { found: found as u64, most: limit as u64 }.at(field))
}

/// A length or count from one to `limit`.
pub(crate) fn one_to(field: &str, found: usize, limit: usize) -> Result<(), Reject> {
    at_most(field, found, limit)?;
    at_least(field, found, 1)
}

/// A length or count of `limit` at least.
pub(crate) fn at_least(field: &str, found: usize, limit: usize) -> Result<(), Reject> {
    if found >= limit {
        return Ok(());
    }
    Err(Refusal::TooFew { found: found as u64, least: limit as u64 }.at(field))
}

/// An array's length against the product of its shape.
pub(crate) fn length(field: &str, found: usize, expected: usize) -> Result<(), Reject> {
    if found == expected {
        return Ok(());
    }
    Err(Refusal::WrongLength { found: found as u64, expected: expected as u64 }.at(field))
}

/// Length, finiteness and magnitude of several arrays of the same shape.
pub(crate) fn arrays(expected: usize, fields: &[(&str, &F64Array)]) -> Result<(), Reject> {
    fields.iter().try_for_each(|(field, array)| {
        length(field, array.len(), expected)?;
        array_numbers(field, array)
    })
}

/// A trajectory of [`MAX_STEPS`] states at most: when it was planned, how long it holds and the time between states,
/// s; then x, y, heading, v and omega, all of one length.
pub(crate) fn trajectory(
    stamp: f64,
    valid_for_s: f64,
    dt: f64,
    states: [&F64Array; 5],
) -> Result<(), Reject> {
    number("stamp", stamp)?;
    non_negative(&[("valid_for_s", valid_for_s)])?;
    positive(&[("dt", dt)])?;
    let [x, y, heading, v, omega] = states;
    at_most("x", x.len(), MAX_STEPS)?;
    arrays(x.len(), &[("x", x), ("y", y), ("heading", heading), ("v", v), ("omega", omega)])
}

/// Finiteness and magnitude of an array.
pub(crate) fn array_numbers(field: &str, array: &F64Array) -> Result<(), Reject> {
    // Without an early exit the loop runs several numbers at a time; the place is looked up only on refusal.
    if array.iter().fold(true, |good, value| good & (value.abs() <= MAX_MAGNITUDE)) {
        return Ok(());
    }
    let index = array.iter().position(|value| number(field, *value).is_err()).unwrap_or_default();
    number(&format!("{field}[{index}]"), array[index])
}

/// [`arrays`] for single precision.
pub(crate) fn array_f32(field: &str, array: &F32Array, expected: usize) -> Result<(), Reject> {
    length(field, array.len(), expected)?;
    match array.iter().position(|value| number(field, f64::from(*value)).is_err()) {
        Some(index) => number(&format!("{field}[{index}]"), f64::from(array[index])),
        None => Ok(()),
    }
}

/// A row-major 3x3 covariance of (x, y, heading): nine numbers, no negative variance.
pub(crate) fn covariance(field: &str, array: &F64Array) -> Result<(), Reject> {
    arrays(9, &[(field, array)])?;
    match [0, 4, 8].into_iter().find(|index| array[*index] < 0.0) {
        Some(index) => within(&format!("{field}[{index}]"), array[index], 0.0, MAX_MAGNITUDE),
        None => Ok(()),
    }
}

/// A text of [`MAX_TEXT`] bytes at most.
pub(crate) fn text(field: &str, text: &str) -> Result<(), Reject> {
    at_most(field, text.len(), MAX_TEXT)
}

/// [`text`] for a field that may be absent.
pub(crate) fn optional_text(field: &str, value: Option<&str>) -> Result<(), Reject> {
    value.map_or(Ok(()), |value| text(field, value))
}

/// A list of texts.
pub(crate) fn texts(field: &str, texts: &[String], limit: usize) -> Result<(), Reject> {
    at_most(field, texts.len(), limit)?;
    texts.iter().try_for_each(|entry| text(field, entry))
}

/// A name that can be a chunk of a key.
pub(crate) fn id(field: &str, value: &str) -> Result<(), Reject> {
    check_id(value).map_err(|error| Refusal::NotAName { found: cut(error.name) }.at(field))
}

/// A list of names.
pub(crate) fn ids<'a>(
    field: &str,
    names: impl ExactSizeIterator<Item = &'a String>,
    limit: usize,
) -> Result<(), Reject> {
    at_most(field, names.len(), limit)?;
    names.into_iter().try_for_each(|name| id(field, name))
}

/// A part of the message.
pub(crate) fn part(field: &str, value: &impl Validate) -> Result<(), Reject> {
    value.validate().map_err(|reject| reject.within(field))
}

/// Free-form parameters: a map with text keys, every number finite.
pub(crate) fn parameters(field: &str, value: &Value) -> Result<(), Reject> {
    if value.is_map() { free_form(field, value) } else { Err(Refusal::NotAMap.at(field)) }
}

/// The decoder has bounded the depth, so the recursion is bounded.
fn free_form(field: &str, value: &Value) -> Result<(), Reject> {
    match value {
        Value::Float(number) if !number.is_finite() => Err(Refusal::NotFinite.at(field)),
        Value::Text(entry) => text(field, entry),
        Value::Array(entries) => entries.iter().try_for_each(|entry| free_form(field, entry)),
        Value::Map(entries) => entries.iter().try_for_each(|(key, entry)| match key {
            Value::Text(key) => {
                text(field, key)?;
                free_form(&format!("{field}.{key}"), entry)
            }
            _ => Err(Refusal::NotAMap.at(field)),
        }),
        Value::Tag(_, entry) => free_form(field, entry),
        _ => Ok(()),
    }
}

impl Validate for Reject {
    fn validate(&self) -> Result<(), Reject> {
        optional_text("field", self.field.as_deref())?;
        match &self.why {
            Refusal::OutOfRange { found, least, most } => {
                numbers(&[("found", *found), ("least", *least), ("most", *most)])
            }
            Refusal::NotPositive { found } => number("found", *found),
            Refusal::UnreachableGoal { x, y } => numbers(&[("x", *x), ("y", *y)]),
            Refusal::WrongEncoding { found, expected } => {
                text("found", found)?;
                text("expected", expected)
            }
            Refusal::UnknownName { found, known } => {
                text("found", found)?;
                texts("known", known, MAX_LIST)
            }
            Refusal::NoReplica { term, detail, .. } => {
                id("term", term)?;
                text("detail", detail)
            }
            Refusal::NotAName { found } | Refusal::UnsafePath { found } | Refusal::MissingFile { found } => {
                text("found", found)
            }
            Refusal::WrongStructure { detail }
            | Refusal::Invalid { detail }
            | Refusal::Cold { detail }
            | Refusal::NoMap { detail }
            | Refusal::Failed { detail } => text("detail", detail),
            _ => Ok(()),
        }
    }
}
