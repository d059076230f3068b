//! The golden bytes are what the CDDL describes and survive a round trip. That they are what the types write is tested
//! where the examples are made, in `tests/support`.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use ciborium::Value;
use curionav_schemas::{MESSAGES, recode};
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use support::{changed, fixed_form, goldens, parse, write};

mod support;

fn schemas() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).to_path_buf()
}

/// All CDDL files in the order of their names, as one text.
fn cddl() -> String {
    let mut files: Vec<_> = std::fs::read_dir(schemas())
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .filter(|path| path.extension().is_some_and(|extension| extension == "cddl"))
        .collect();
    files.sort();
    files.iter().map(|path| std::fs::read_to_string(path).unwrap()).collect()
}

/// The validator knows no tags: `#6.86(bstr)` is written as `[86, bstr]` in the rules and in the data alike.
fn rules_without_tags() -> String {
    let mut rules = cddl();
    while let Some(start) = rules.find("#6.") {
        let open = start + rules[start..].find('(').unwrap();
        let close = open + rules[open..].find(')').unwrap();
        rules = format!(
            "{}[{}, {}]{}",
            &rules[..start],
            &rules[start + 3..open],
            &rules[open + 1..close],
            &rules[close + 1..]
        );
    }
    rules
}

fn without_tags(value: Value) -> Value {
    match value {
        Value::Tag(tag, content) => Value::Array(vec![tag.into(), without_tags(*content)]),
        Value::Array(entries) => Value::Array(entries.into_iter().map(without_tags).collect()),
        Value::Map(entries) => {
            Value::Map(entries.into_iter().map(|(key, value)| (key, without_tags(value))).collect())
        }
        other => other,
    }
}

fn obeys(rule: &str, rules: &str, message: &Value) -> Result<(), String> {
    cddl_cat::validate_cbor_bytes(rule, rules, &write(&without_tags(message.clone())))
        .map_err(|error| error.to_string())
}

#[test]
fn golden_bytes_survive_a_round_trip() {
    for golden in goldens() {
        let encoding = format!("application/cbor;curionav.{}.v1", golden.message);
        let again = recode(&golden.message, &golden.bytes, Some(&encoding)).unwrap();
        assert_eq!(again.as_deref(), Ok(&golden.bytes[..]), "{}", golden.file);
    }
}

#[test]
fn the_crate_carries_the_whole_contract() {
    assert_eq!(curionav_schemas::CDDL, cddl());
}

#[test]
fn every_message_has_an_example() {
    let shown: BTreeSet<_> = goldens().into_iter().map(|golden| golden.message).collect();
    assert_eq!(shown, MESSAGES.iter().map(|message| message.name.to_owned()).collect());
}

#[test]
fn golden_bytes_obey_the_cddl() {
    let rules = rules_without_tags();
    for golden in goldens() {
        obeys(&golden.message, &rules, &parse(&golden.bytes))
            .unwrap_or_else(|error| panic!("{}: {error}", golden.file));
    }
}

#[test]
fn the_cddl_describes_every_field_and_its_type() {
    let rules = rules_without_tags();
    for golden in goldens() {
        let message = fixed_form(parse(&golden.bytes));
        obeys(&golden.message, &rules, &message).unwrap_or_else(|error| panic!("{}: {error}", golden.file));
        let nulls = changed(&message, &|_| vec![Value::Null]);
        let strangers = changed(&message, &|value| match value {
            Value::Map(entries) if !entries.is_empty() => {
                let mut entries = entries.clone();
                entries.push(("Not in the contract".into(), Value::Null));
                vec![Value::Map(entries)]
            }
            Value::Tag(tag, content) => vec![Value::Tag(tag + 1, content.clone())],
            _ => Vec::new(),
        });
        for wrong in nulls.into_iter().chain(strangers) {
            assert!(obeys(&golden.message, &rules, &wrong).is_err(), "{}: {wrong:?}", golden.file);
        }
    }
}

#[test]
fn the_readme_states_every_size_limit() {
    let readme = std::fs::read_to_string(schemas().join("README.md")).unwrap();
    for message in MESSAGES {
        let row = format!("| `{}` | {} KiB |", message.name, message.max_bytes / 1024);
        assert!(readme.contains(&row), "README.md lacks: {row}");
    }
}
