//! Messages put together from parts that were encoded apart.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use ciborium::Value;
use curionav_schemas::{Fields, recode};
use support::{goldens, parse};

mod support;

fn fields(entries: &[(Value, Value)]) -> Fields {
    entries
        .iter()
        .fold(Fields::default(), |fields, (name, value)| fields.with(name.as_text().unwrap(), value))
}

#[test]
fn parts_in_any_order_make_up_the_message() {
    for golden in goldens() {
        let Value::Map(entries) = parse(&golden.bytes) else { panic!("a message is a map") };
        for cut in 0..=entries.len() {
            let (first, second) = (fields(&entries[..cut]), fields(&entries[cut..]));
            let put_together = second.and(&first).into_bytes();
            let again = recode(&golden.message, &put_together, None).unwrap();
            assert_eq!(again.as_deref(), Ok(&golden.bytes[..]), "{} cut at {cut}", golden.file);
        }
    }
}

#[test]
fn a_part_of_fields_is_the_part_itself() {
    for golden in goldens() {
        let Value::Map(entries) = parse(&golden.bytes) else { panic!("a message is a map") };
        let apart = entries.iter().fold(Fields::default(), |fields, (name, value)| {
            let name = name.as_text().unwrap();
            match value {
                Value::Map(part) if part.len() < 24 => fields.with_part(name, &self::fields(part)),
                _ => fields.with(name, value),
            }
        });
        assert_eq!(apart.into_bytes(), golden.bytes, "{}", golden.file);
    }
}

#[test]
#[should_panic(expected = "23 fields")]
fn more_fields_than_a_short_head_can_count_are_found_out() {
    let _ = (0..24).fold(Fields::default(), |fields, k| fields.with(&format!("f{k}"), &k));
}
