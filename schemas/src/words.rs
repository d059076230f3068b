//! Codes in words, for people. The table is `words.toml`, which Python reads, too.

use ciborium::Value;
use ciborium::value::Integer;
use serde::Serialize;
use std::collections::BTreeMap;
use std::sync::LazyLock;

use crate::limits::UNSEEN_PERSON;

/// The table: by family and code, a sentence with places for the parameters.
pub const TABLE: &str = include_str!("../words.toml");

type Table = BTreeMap<String, BTreeMap<String, String>>;

static WORDS: LazyLock<Table> = LazyLock::new(|| {
    // A test reads the table too, so a shipped one is well-formed.
    toml::from_str(TABLE).unwrap_or_default()
});

/// `reason` in words: a code of `family` by itself, or a map with its `code` and its parameters. A code that the table
/// does not have is its own word.
pub fn say(family: &str, reason: &impl Serialize) -> String {
    Value::serialized(reason).map(|value| sentence(family, &value)).unwrap_or_default()
}

/// Several of `family`, each by [`say`], with semicolons between them.
pub fn say_all<'a, R: Serialize + 'a>(family: &str, reasons: impl IntoIterator<Item = &'a R>) -> String {
    reasons.into_iter().map(|reason| say(family, reason)).collect::<Vec<_>>().join("; ")
}

fn sentence(family: &str, reason: &Value) -> String {
    let code = reason.as_text().or_else(|| parameter(reason, "code")?.as_text()).unwrap_or_default();
    let Some(template) = WORDS.get(family).and_then(|codes| codes.get(code)) else { return code.to_owned() };
    let mut said = String::new();
    let mut rest = template.as_str();
    while let Some((before, after)) = rest.split_once('{') {
        let (place, after) = after.split_once('}').unwrap_or((after, ""));
        let (name, decimals) = place.split_once(":.").unwrap_or((place, ""));
        said.push_str(before);
        said.push_str(&parameter(reason, name).map(|value| word(name, value, decimals)).unwrap_or_default());
        rest = after;
    }
    said + rest
}

/// Whether the table has words for `code` of `family`.
pub fn knows(family: &str, code: &str) -> bool {
    WORDS.get(family).is_some_and(|codes| codes.contains_key(code))
}

/// A person by its identity.
fn person(id: &Integer) -> String {
    let code = if *id == Integer::from(UNSEEN_PERSON) { "unseen" } else { "any" };
    let parameters = [("code", Value::from(code)), ("number", Value::Integer(*id))];
    let parameters = parameters.map(|(key, value)| (Value::from(key), value));
    sentence("person", &Value::Map(parameters.into()))
}

fn parameter<'a>(reason: &'a Value, name: &str) -> Option<&'a Value> {
    reason.as_map()?.iter().find(|(key, _)| key.as_text() == Some(name)).map(|(_, value)| value)
}

fn word(name: &str, value: &Value, decimals: &str) -> String {
    match value {
        // `reject` is a refusal with the field it is about.
        Value::Map(_) if parameter(value, "why").is_some() => {
            let field = parameter(value, "field").and_then(Value::as_text);
            let why = parameter(value, "why").map(|why| sentence("refusal", why)).unwrap_or_default();
            field.map_or(why.clone(), |field| format!("{field}: {why}"))
        }
        Value::Map(_) => sentence(name, value),
        Value::Text(text) if WORDS.contains_key(name) => sentence(name, &Value::Text(text.clone())),
        Value::Text(text) => text.clone(),
        Value::Integer(id) if name == "person" => person(id),
        Value::Integer(number) => i128::from(*number).to_string(),
        Value::Float(number) => match decimals.parse::<usize>() {
            Ok(decimals) => format!("{number:.decimals$}"),
            Err(_) => format!("{number:?}").trim_end_matches(".0").to_owned(),
        },
        Value::Array(values) => {
            values.iter().map(|value| word(name, value, decimals)).collect::<Vec<_>>().join(", ")
        }
        _ => String::new(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{CommandReason, MissionEnd, PreviousState, Reason, Refusal, Rejection};

    #[test]
    fn parameters_stand_in_their_places() {
        let previous = PreviousState::Strayed { distance_m: 0.714 };
        let reason = Reason::NotScored { term: "cpc".into(), previous };
        assert_eq!(
            say("reason", &reason),
            "no candidate has every score, `cpc` is missing; the robot is 0.71 m off the previous trajectory"
        );
        assert_eq!(say("command_reason", &CommandReason::NoScan), "no scan yet");
        let refusal = Refusal::OutOfRange { found: 1e-12, least: 1.0, most: 2.5 };
        assert_eq!(say("refusal", &refusal), "1e-12 is not within 1 to 2.5");
        let reject = refusal.at("tick_s");
        let end = MissionEnd::Unprepared { role: "localizer".into(), instance: "a".into(), reject };
        assert_eq!(say("end", &end), "localizer a cannot prepare: tick_s: 1e-12 is not within 1 to 2.5");
    }

    #[test]
    fn a_code_without_words_is_its_own_word() {
        assert_eq!(say("reason", &"of_next_year"), "of_next_year");
        assert_eq!(say("family", &Reason::Arrived), "arrived");
    }

    #[test]
    fn what_only_the_driver_sees_is_no_person_with_a_number() {
        let hits = |person| Rejection::HitsPerson { person, after_s: 1.2 };
        assert_eq!(say("rejection", &hits(7)), "runs into person 7 after 1.2 s");
        let unseen = "runs into something unseen that the driver braked for after 1.2 s";
        assert_eq!(say("rejection", &hits(UNSEEN_PERSON)), unseen);
        assert!(knows("term_meaning", "cpc") && !knows("term_meaning", "view"));
    }
}
