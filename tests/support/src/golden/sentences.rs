//! One example of every code of the contract, made from the CDDL itself, and the sentence that the words make of it.

use curionav_schemas::{CDDL, Value, words};

/// The rules whose alternatives are codes, each with its family in the table of words.
const FAMILIES: [(&str, &str); 9] = [
    ("reason", "reason"),
    ("previous_state", "previous"),
    ("rejection", "rejection"),
    ("degradation", "degradation"),
    ("command_reason", "command_reason"),
    ("confidence", "confidence"),
    ("mission_end", "end"),
    ("refusal", "refusal"),
    ("cbor_fault", "fault"),
];

/// A code with its parameters, and how a person reads it.
#[derive(Debug, Clone, PartialEq)]
pub struct Sentence {
    /// Its family in the table of words.
    pub family: &'static str,
    /// The code by itself, or a map with the code and an example of every parameter.
    pub reason: Value,
    /// The words.
    pub said: String,
}

/// Every code of every family.
pub fn sentences() -> Vec<Sentence> {
    let of = |(rule, family): (&str, &'static str)| {
        alternatives(rule).into_iter().map(move |alternative| {
            let reason = example(alternative);
            Sentence { family, said: words::say(family, &reason), reason }
        })
    };
    FAMILIES.into_iter().flat_map(of).collect()
}

/// The sentences as they stand in `schemas/golden/sentences.cbor`: a list of maps with `family`, `reason` and `said`.
pub fn encoded() -> Vec<u8> {
    let entry = |sentence: Sentence| {
        Value::Map(vec![
            ("family".into(), sentence.family.into()),
            ("reason".into(), sentence.reason),
            ("said".into(), sentence.said.into()),
        ])
    };
    let mut bytes = Vec::new();
    let all = Value::Array(sentences().into_iter().map(entry).collect());
    // Writing into memory takes all bytes.
    let _ = ciborium::into_writer(&all, &mut bytes);
    bytes
}

/// The alternatives of a rule, which begins at the start of a line and ends before an empty one.
fn alternatives(rule: &str) -> Vec<&'static str> {
    let begin = format!("\n{rule} = ");
    let Some(at) = CDDL.find(&begin) else { return Vec::new() };
    let body = &CDDL[at + begin.len()..];
    let body = &body[..body.find("\n\n").unwrap_or(body.len())];
    let without_comment = |line: &'static str| line.split(';').next().unwrap_or_default();
    body.lines()
        .flat_map(|line| without_comment(line).split(" / "))
        .map(clean)
        .filter(|a| !a.is_empty())
        .collect()
}

fn clean(alternative: &'static str) -> &'static str {
    alternative.trim().trim_start_matches("/ ").trim()
}

/// A value that obeys an alternative: a quoted code, or `{ code: "...", name: type }`.
fn example(alternative: &'static str) -> Value {
    let Some(fields) = alternative.strip_prefix('{').and_then(|rest| rest.strip_suffix('}')) else {
        return alternative.trim_matches('"').into();
    };
    let field = |field: &'static str| {
        let (name, kind) = field.split_once(':')?;
        Some((name.trim().into(), parameter(kind.trim())))
    };
    Value::Map(fields.split(", ").filter_map(field).collect())
}

fn parameter(kind: &'static str) -> Value {
    match kind {
        "uint" | "uint32" => 3.into(),
        "float" => 1.25.into(),
        "bool" => true.into(),
        "identifier" => "cpc-1".into(),
        "tstr" => "some detail".into(),
        "[* tstr]" => Value::Array(vec!["one".into(), "two".into()]),
        "reject" => {
            let why =
                Value::Map(vec![("code".into(), "not_positive".into()), ("found".into(), (-0.5).into())]);
            Value::Map(vec![("field".into(), "terms.cpc".into()), ("why".into(), why)])
        }
        quoted if quoted.starts_with('"') => quoted.trim_matches('"').into(),
        // The first alternative of another rule.
        rule => alternatives(rule).first().map_or(Value::Null, |first| example(first)),
    }
}
