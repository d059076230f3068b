//! The types, the CDDL and the table of words know the same codes with the same parameters.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use ciborium::Value;
use curionav_schemas::{
    CborFault, CommandReason, Confidence, Degradation, MissionEnd, PreviousState, Reason, Refusal, Rejection,
    words,
};
use serde::{Serialize, de::DeserializeOwned};
use std::collections::{BTreeMap, BTreeSet};
use strum::VariantNames;
use support::{golden_file, parse};

mod support;

/// The codes that a family's type has.
fn codes_of_type(family: &str) -> &'static [&'static str] {
    match family {
        "reason" => Reason::VARIANTS,
        "previous" => PreviousState::VARIANTS,
        "rejection" | "rejections" => Rejection::VARIANTS,
        "degradation" => Degradation::VARIANTS,
        "command_reason" => CommandReason::VARIANTS,
        "confidence" => Confidence::VARIANTS,
        "end" => MissionEnd::VARIANTS,
        "refusal" => Refusal::VARIANTS,
        "fault" => CborFault::VARIANTS,
        other => panic!("the family `{other}` of the words belongs to no type"),
    }
}

fn set<'a>(codes: impl IntoIterator<Item = &'a str>) -> BTreeSet<String> {
    codes.into_iter().map(str::to_owned).collect()
}

/// An example of a code, and how a person reads it.
#[derive(Debug, serde::Deserialize)]
struct Sentence {
    family: String,
    reason: Value,
    said: String,
}

/// One example of every code of the CDDL.
fn sentences() -> Vec<Sentence> {
    parse(&golden_file("sentences.cbor")).deserialized().unwrap()
}

fn code(reason: &Value) -> String {
    let of_map = || reason.as_map()?.iter().find(|(key, _)| key.as_text() == Some("code"))?.1.as_text();
    reason.as_text().or_else(of_map).unwrap().to_owned()
}

#[test]
fn every_code_has_words_and_every_word_a_code() {
    // Those of an explanation are no codes of the contract.
    let of_contract =
        |family: &str| !["explanation", "evaluated", "person", "term_meaning"].contains(&family);
    let table: BTreeMap<String, BTreeMap<String, String>> = toml::from_str(words::TABLE).unwrap();
    for (family, codes) in table.iter().filter(|(family, _)| of_contract(family)) {
        let codes = codes.keys().map(String::as_str);
        assert_eq!(set(codes), set(codes_of_type(family).iter().copied()), "{family}");
    }
}

#[test]
fn the_cddl_has_every_code_of_the_types() {
    let mut shown: BTreeMap<String, BTreeSet<String>> = BTreeMap::new();
    for sentence in sentences() {
        shown.entry(sentence.family).or_default().insert(code(&sentence.reason));
    }
    assert_eq!(shown.len(), 9);
    for (family, codes) in shown {
        assert_eq!(codes, set(codes_of_type(&family).iter().copied()), "{family}");
    }
}

/// Reads the example as `T` and writes it again: the same, so `T` has these parameters and no others.
fn survives<T: Serialize + DeserializeOwned>(reason: &Value) {
    let read: T = reason.deserialized().unwrap_or_else(|e| panic!("{reason:?}: {e}"));
    let mut again = Value::serialized(&read).unwrap();
    let mut reason = reason.clone();
    for value in [&mut again, &mut reason] {
        if let Value::Map(entries) = value {
            entries.sort_by_key(|(key, _)| key.as_text().unwrap().to_owned());
        }
    }
    assert_eq!(again, reason);
}

#[test]
fn the_types_have_the_parameters_of_the_cddl() {
    for sentence in sentences() {
        let check = match sentence.family.as_str() {
            "reason" => survives::<Reason>,
            "previous" => survives::<PreviousState>,
            "rejection" => survives::<Rejection>,
            "degradation" => survives::<Degradation>,
            "command_reason" => survives::<CommandReason>,
            "confidence" => survives::<Confidence>,
            "end" => survives::<MissionEnd>,
            "refusal" => survives::<Refusal>,
            "fault" => survives::<CborFault>,
            other => panic!("{other}"),
        };
        check(&sentence.reason);
    }
}

#[test]
fn every_place_of_a_sentence_is_filled() {
    for sentence in sentences() {
        let said = &sentence.said;
        assert!(!said.is_empty() && !said.contains(['{', '}']), "{sentence:?}");
        // A place without its parameter leaves nothing between its neighbours.
        for gap in ["``", "  ", "()", ": ;", " ;"] {
            assert!(!said.contains(gap), "{sentence:?}");
        }
        assert!(!said.ends_with([' ', ':', ';']), "{sentence:?}");
    }
}
