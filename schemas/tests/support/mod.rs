//! Changing one thing at a time in an encoded message.

use ciborium::Value;

/// Fields whose content is free-form.
const FREE_FORM: [&str; 5] = ["params", "profile", "localizer", "scenario", "files"];

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
