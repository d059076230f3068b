//! The checks that every message is built from. Each is a function of a field's name and value, or makes one of a
//! limit, and names the field that it refuses.

use crate::array::TypedArray;
use crate::limits::{MAX_LIST, MAX_MAGNITUDE, MAX_TEXT};
use crate::names::check_id;
use crate::reject::cut;
use crate::{F64Array, Refusal, Reject, Validate};
use ciborium::Value;
use std::collections::BTreeMap;
use std::ops::Deref;

pub(crate) type Checked = Result<(), Reject>;

/// Implements [`Validate`] by a table of fields: the checks are made in its order. The name before the type stands for
/// the message, so that a check may depend on another field. For an enum the fields stand below their variants.
macro_rules! checks {
    ($type:ident { $($variant:ident { $($field:ident: $check:expr),+ })* }) => {
        impl crate::message::Validate for $type {
            fn validate(&self) -> Result<(), crate::reject::Reject> {
                #[allow(unreachable_patterns, reason = "a table may name every variant")]
                match self {
                    $(Self::$variant { $($field,)+ .. } => {
                        $(($check)(stringify!($field), $field)?;)+
                    })*
                    _ => {}
                }
                Ok(())
            }
        }
    };
    ($message:ident: $type:ty { $($($field:ident),+: $check:expr;)* }) => {
        impl crate::message::Validate for $type {
            fn validate(&self) -> Result<(), crate::reject::Reject> {
                let $message = self;
                $($(($check)(stringify!($field), &$message.$field)?;)+)*
                Ok(())
            }
        }
    };
}
pub(crate) use checks;

/// Refuses a number that is not finite or larger than anything physical.
pub(crate) fn number<T: Copy + Into<f64>>(field: &str, value: &T) -> Checked {
    // A NaN is not within the bound either.
    if (*value).into().abs() <= MAX_MAGNITUDE {
        return Ok(());
    }
    Err(Refusal::NotFinite.at(field))
}

pub(crate) fn positive(field: &str, value: &f64) -> Checked {
    number(field, value)?;
    if *value > 0.0 {
        return Ok(());
    }
    Err(Refusal::NotPositive { found: *value }.at(field))
}

pub(crate) fn non_negative<T: Copy + Into<f64>>(field: &str, value: &T) -> Checked {
    within(0.0, MAX_MAGNITUDE)(field, value)
}

pub(crate) fn fraction<T: Copy + Into<f64>>(field: &str, value: &T) -> Checked {
    within(0.0, 1.0)(field, value)
}

pub(crate) fn within<T: Copy + Into<f64>>(least: f64, most: f64) -> impl Fn(&str, &T) -> Checked {
    move |field, value| {
        number(field, value)?;
        let found = (*value).into();
        if (least..=most).contains(&found) {
            return Ok(());
        }
        Err(Refusal::OutOfRange { found, least, most }.at(field))
    }
}

pub(crate) fn count(least: usize, most: usize) -> impl Fn(&str, &u32) -> Checked {
    move |field, value| size(field, *value as usize, least, most)
}

pub(crate) fn length<T, L: Deref<Target = [T]>>(least: usize, most: usize) -> impl Fn(&str, &L) -> Checked {
    move |field, list| size(field, list.len(), least, most)
}

pub(crate) fn size(field: &str, found: usize, least: usize, most: usize) -> Checked {
    if found > most {
        return Err(Refusal::TooMany { found: found as u64, most: most as u64 }.at(field));
    }
    if found < least {
        return Err(Refusal::TooFew { found: found as u64, least: least as u64 }.at(field));
    }
    Ok(())
}

/// An array's length against the product of its shape.
pub(crate) fn shape(field: &str, found: usize, expected: usize) -> Checked {
    if found == expected {
        return Ok(());
    }
    Err(Refusal::WrongLength { found: found as u64, expected: expected as u64 }.at(field))
}

pub(crate) fn exactly<T>(expected: usize) -> impl Fn(&str, &TypedArray<T>) -> Checked {
    move |field, array| shape(field, array.len(), expected)
}

/// An array of `expected` [numbers].
pub(crate) fn array<T: Copy + Into<f64>>(expected: usize) -> impl Fn(&str, &TypedArray<T>) -> Checked {
    move |field, array| {
        shape(field, array.len(), expected)?;
        numbers(field, array)
    }
}

/// Finiteness and magnitude of an array.
pub(crate) fn numbers<T: Copy + Into<f64>>(field: &str, array: &TypedArray<T>) -> Checked {
    // Without an early exit the loop runs several numbers at a time; the place is looked up only on refusal.
    if array.iter().fold(true, |good, value| good & ((*value).into().abs() <= MAX_MAGNITUDE)) {
        return Ok(());
    }
    each(number)(field, array)
}

/// A check of every element, which names the first at fault.
pub(crate) fn each<T>(check: impl Fn(&str, &T) -> Checked) -> impl Fn(&str, &TypedArray<T>) -> Checked {
    move |field, array| match array.iter().position(|value| check(field, value).is_err()) {
        Some(index) => check(&format!("{field}[{index}]"), &array[index]),
        None => Ok(()),
    }
}

/// Indices or identifiers that rise.
pub(crate) fn ascending(field: &str, indices: &[u32]) -> Checked {
    if indices.is_sorted_by(|a, b| a < b) {
        return Ok(());
    }
    Err(Refusal::NotAscending.at(field))
}

/// A row-major 3x3 covariance of (x, y, heading): nine numbers, no negative variance.
pub(crate) fn covariance(field: &str, values: &F64Array) -> Checked {
    array(9)(field, values)?;
    let negative = [0, 4, 8].into_iter().find(|index| values[*index] < 0.0);
    negative.map_or(Ok(()), |index| non_negative(&format!("{field}[{index}]"), &values[index]))
}

/// As many covariances (xx, xy, yy) in the plane: no negative variance.
pub(crate) fn planar_covariances(count: usize) -> impl Fn(&str, &F64Array) -> Checked {
    move |field, values| {
        array(3 * count)(field, values)?;
        let negative = (0..values.len()).find(|index| index % 3 != 1 && values[*index] < 0.0);
        negative.map_or(Ok(()), |index| non_negative(&format!("{field}[{index}]"), &values[index]))
    }
}

/// A text of [`MAX_TEXT`] bytes at most.
pub(crate) fn text(field: &str, text: &impl AsRef<str>) -> Checked {
    size(field, text.as_ref().len(), 0, MAX_TEXT)
}

/// A name that can be a chunk of a key.
pub(crate) fn id(field: &str, name: &impl AsRef<str>) -> Checked {
    check_id(name.as_ref()).map_err(|error| Refusal::NotAName { found: cut(error.name) }.at(field))
}

/// A list of `limit` entries at most, each as `check` says.
pub(crate) fn list<T>(
    limit: usize,
    check: impl Fn(&str, &T) -> Checked,
) -> impl Fn(&str, &Vec<T>) -> Checked {
    move |field, entries| {
        size(field, entries.len(), 0, limit)?;
        entries.iter().try_for_each(|entry| check(field, entry))
    }
}

/// A map of `limit` entries at most, whose keys are names.
pub(crate) fn keys<T>(limit: usize) -> impl Fn(&str, &BTreeMap<String, T>) -> Checked {
    move |field, entries| {
        size(field, entries.len(), 0, limit)?;
        entries.keys().try_for_each(|name| id(field, name))
    }
}

pub(crate) fn named_numbers(field: &str, entries: &BTreeMap<String, f64>) -> Checked {
    entries.iter().try_for_each(|(name, value)| number(&format!("{field}.{name}"), value))
}

pub(crate) fn optional<T>(check: impl Fn(&str, &T) -> Checked) -> impl Fn(&str, &Option<T>) -> Checked {
    move |field, value| value.as_ref().map_or(Ok(()), |value| check(field, value))
}

pub(crate) fn part<T: Validate>(field: &str, value: &T) -> Checked {
    value.validate().map_err(|reject| reject.within(field))
}

/// Free-form parameters: a map with text keys, every number finite.
pub(crate) fn parameters(field: &str, value: &Value) -> Checked {
    if value.is_map() { free_form(field, value) } else { Err(Refusal::NotAMap.at(field)) }
}

/// The decoder has bounded the depth, so the recursion is bounded.
fn free_form(field: &str, value: &Value) -> Checked {
    match value {
        Value::Float(number) if !number.is_finite() => Err(Refusal::NotFinite.at(field)),
        Value::Text(entry) => text(field, entry),
        Value::Array(entries) => entries.iter().try_for_each(|entry| free_form(field, entry)),
        Value::Map(entries) => entries.iter().try_for_each(|(key, entry)| match key {
            Value::Text(key) => {
                text(field, key)?;
                free_form(key, entry).map_err(|reject| reject.within(field))
            }
            _ => Err(Refusal::NotAMap.at(field)),
        }),
        Value::Tag(_, entry) => free_form(field, entry),
        _ => Ok(()),
    }
}

checks! { reject: Reject {
    field: optional(text);
    why: |_: &str, why: &Refusal| why.validate();
}}

checks! { Refusal {
    OutOfRange { found: number, least: number, most: number }
    NotPositive { found: number }
    UnreachableGoal { x: number, y: number }
    NoRoomAtGoal { x: number, y: number, room: number, radius: number }
    WrongEncoding { found: text, expected: text }
    UnknownName { found: text, known: list(MAX_LIST, text) }
    NoReplica { term: id, detail: text }
    NotAName { found: text }
    UnsafePath { found: text }
    WrongStructure { detail: text }
    Invalid { detail: text }
    Cold { detail: text }
    NoMap { detail: text }
    Failed { detail: text }
}}
