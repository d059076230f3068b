//! The golden messages, and changing one thing at a time in one.

#![allow(dead_code, reason = "every file of tests has its own copy of this and uses some of it")]

use ciborium::Value;
use curionav_schemas::Message;
use std::path::Path;

/// Fields whose content is free-form.
const FREE_FORM: [&str; 6] = ["params", "profile", "localizer", "tracker", "scenario", "files"];

/// A file of `golden/`.
pub(crate) fn golden_file(name: &str) -> Vec<u8> {
    std::fs::read(Path::new(env!("CARGO_MANIFEST_DIR")).join("golden").join(name)).unwrap()
}

/// An encoded message of `golden/`.
pub(crate) struct Golden {
    /// Its file without `.cbor`.
    pub(crate) file: String,
    /// [`Message::NAME`], which is also the CDDL rule.
    pub(crate) message: String,
    pub(crate) bytes: Vec<u8>,
}

/// Every message of `golden/`, by its index.
pub(crate) fn goldens() -> Vec<Golden> {
    let index = String::from_utf8(golden_file("index.txt")).unwrap();
    let lines = index.lines().filter(|line| !line.starts_with('#'));
    let golden = |line: &str| {
        let (file, message) = line.split_once(' ').unwrap();
        let (bytes, message) = (golden_file(file), message.to_owned());
        Golden { file: file.trim_end_matches(".cbor").to_owned(), message, bytes }
    };
    lines.map(golden).collect()
}

/// The golden message of this type.
pub(crate) fn golden<M: Message>() -> M {
    M::decode(&golden_file(&format!("{}.cbor", M::NAME)), None).unwrap()
}

pub(crate) fn parse(bytes: &[u8]) -> Value {
    ciborium::from_reader(bytes).unwrap()
}

pub(crate) fn write(value: &Value) -> Vec<u8> {
    let mut bytes = Vec::new();
    ciborium::into_writer(value, &mut bytes).unwrap();
    bytes
}

/// Every tree that differs from `value` in one node, as `change` says; tags count as one node with their content.
pub(crate) fn changed(value: &Value, change: &dyn Fn(&Value) -> Vec<Value>) -> Vec<Value> {
    let mut all = change(value);
    match value {
        Value::Map(entries) => {
            for (index, (_, entry)) in entries.iter().enumerate() {
                all.extend(changed(entry, change).into_iter().map(|entry| {
                    let mut entries = entries.clone();
                    entries[index].1 = entry;
                    Value::Map(entries)
                }));
            }
        }
        Value::Array(entries) => {
            for (index, entry) in entries.iter().enumerate() {
                all.extend(changed(entry, change).into_iter().map(|entry| {
                    let mut entries = entries.clone();
                    entries[index] = entry;
                    Value::Array(entries)
                }));
            }
        }
        _ => {}
    }
    all
}

/// The message without what is free-form in it.
pub(crate) fn fixed_form(value: Value) -> Value {
    match value {
        Value::Map(entries) => Value::Map(
            entries
                .into_iter()
                .map(|(key, entry)| {
                    let free = key.as_text().is_some_and(|key| FREE_FORM.contains(&key)) && entry.is_map();
                    (key, if free { Value::Map(Vec::new()) } else { fixed_form(entry) })
                })
                .collect(),
        ),
        Value::Array(entries) => Value::Array(entries.into_iter().map(fixed_form).collect()),
        other => other,
    }
}
