//! Bytes that nothing has checked: refused with a reason, or read; never a panic.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use ciborium::Value;
use curionav_schemas::{
    CandidateSet, F64Array, MESSAGES, Message, MissionCommand, Refusal, RunStatus, Scan, Twist, recode,
};
use curionav_schemas::{Degradation, Reason, Reject, array::Element, limits::MAX_DEPTH};
use proptest::prelude::*;
use strum::VariantNames;
use support::{changed, fixed_form, golden, goldens, parse, write};

mod support;

fn decode(message: &str, value: &Value) -> Result<Vec<u8>, Reject> {
    recode(message, &write(value), None).unwrap()
}

#[test]
fn arrays_begin_with_their_tag() {
    // 0xd8 is a tag with one byte of number, 0x48 a byte string of eight.
    assert_eq!(write(&Value::serialized(&F64Array::from(vec![1.0])).unwrap())[..3], [0xd8, 86, 0x48]);
    let mut bytes = Vec::new();
    ciborium::into_writer(&F64Array::from(vec![-2.0]), &mut bytes).unwrap();
    assert_eq!(bytes, [0xd8, 86, 0x48, 0, 0, 0, 0, 0, 0, 0, 0xc0]);
    let tags = [f64::TAG, f32::TAG, u32::TAG, i8::TAG, u8::TAG];
    assert_eq!(tags, [86, 85, 70, 72, 64]);
}

#[test]
fn an_array_with_another_tag_or_part_of_an_element_is_refused() {
    for golden in goldens() {
        let wrong = changed(&parse(&golden.bytes), &|value| match value {
            Value::Tag(tag, content) => {
                let cut = |bytes: &Vec<u8>| Value::Bytes(bytes[..bytes.len().saturating_sub(1)].to_vec());
                let Value::Bytes(bytes) = &**content else { panic!("a tag over {content:?}") };
                let mut wrong = vec![
                    Value::Tag(tag - 1, content.clone()),
                    Value::Tag(82, content.clone()),
                    (**content).clone(),
                    Value::Tag(*tag, Box::new(Value::Array(vec![1.0.into()]))),
                    Value::Array(bytes.iter().map(|byte| (*byte).into()).collect()),
                ];
                if !bytes.is_empty() {
                    wrong.push(Value::Tag(*tag, Box::new(cut(bytes))));
                }
                wrong
            }
            _ => Vec::new(),
        });
        for wrong in wrong {
            assert!(decode(&golden.message, &wrong).is_err(), "{}: {wrong:?}", golden.file);
        }
    }
}

#[test]
fn an_array_longer_or_shorter_than_its_shape_is_refused() {
    // How long their arrays are is the sender's affair.
    let any = ["scan", "scores", "tree"];
    for golden in goldens().iter().filter(|golden| !any.contains(&golden.message.as_str())) {
        let right = parse(&golden.bytes);
        let wrong = changed(&right, &|value| match value {
            Value::Tag(tag, content) => {
                let mut bytes = content.as_bytes().unwrap().clone();
                // Five more doubles: no count of candidates.
                bytes.extend([0; 40]);
                vec![Value::Tag(*tag, Box::new(Value::Bytes(bytes)))]
            }
            _ => Vec::new(),
        });
        for wrong in wrong.into_iter().filter(|wrong| without_trees(wrong) != without_trees(&right)) {
            let error = decode(&golden.message, &wrong).expect_err(&golden.file);
            assert!(error.field.is_some(), "{}: {error}", golden.file);
        }
    }
}

fn without_trees(message: &Value) -> Vec<&(Value, Value)> {
    let is_of_trees = |key: &Value| key.as_text().is_some_and(|key| ["tree", "trees"].contains(&key));
    message.as_map().unwrap().iter().filter(|(key, _)| !is_of_trees(key)).collect()
}

#[test]
fn no_number_may_be_infinite_or_absent_from_the_number_line() {
    for golden in goldens() {
        let wrong = changed(&parse(&golden.bytes), &|value| {
            let bad = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];
            match value {
                Value::Float(_) => bad.map(Value::Float).to_vec(),
                Value::Tag(tag @ (85 | 86), content) => {
                    let bytes = content.as_bytes().unwrap();
                    let width = if *tag == 86 { 8 } else { 4 };
                    let at = |index: usize, number: f64| {
                        let mut bytes = bytes.clone();
                        let number = match width {
                            8 => number.to_le_bytes().to_vec(),
                            _ => (number as f32).to_le_bytes().to_vec(),
                        };
                        bytes[index * width..][..width].copy_from_slice(&number);
                        Value::Tag(*tag, Box::new(Value::Bytes(bytes)))
                    };
                    // A beam of a scan that is no number says nothing.
                    let is_allowed = |number: &f64| golden.message == "scan" && number.is_nan();
                    let bad: Vec<f64> = bad.into_iter().filter(|number| !is_allowed(number)).collect();
                    let places = 0..bytes.len() / width;
                    places
                        .flat_map(|index| bad.iter().map(move |number| (index, *number)))
                        .map(|(i, n)| at(i, n))
                        .collect()
                }
                _ => Vec::new(),
            }
        });
        for wrong in wrong {
            let error = decode(&golden.message, &wrong).expect_err(&golden.file);
            assert!(error.field.is_some(), "{}: {error}", golden.file);
        }
    }
}

#[test]
fn unknown_keys_are_ignored_anywhere() {
    let list =
        ("list".into(), Value::Array(vec![1.into(), Value::Null, 0.5.into(), true.into(), "x".into()]));
    // A code's parameters hold no typed arrays, in any version: serde cannot pass over a tag beside a code.
    let parameter = Value::Map(vec![list.clone()]);
    let future =
        Value::Map(vec![("array".into(), Value::Tag(86, Box::new(Value::Bytes(vec![0; 16])))), list]);
    for golden in goldens() {
        let message = fixed_form(parse(&golden.bytes));
        let plain = decode(&golden.message, &message).unwrap();
        let extended = changed(&message, &|value| match value {
            // Maps whose keys are data have no unknown keys; `columns`, `evaluated`, `social`,
            // `other_choice`, `degraded_by` and `metrics` are left here.
            Value::Map(entries) if entries.iter().all(|(key, entry)| is_data(entry) || is_measure(key)) => {
                Vec::new()
            }
            Value::Map(entries) => {
                let mut entries = entries.clone();
                let is_reason = |(key, _): &(Value, Value)| matches!(key.as_text(), Some("code" | "why"));
                let has_code = entries.iter().any(is_reason);
                let new = if has_code { &parameter } else { &future };
                entries.insert(entries.len() / 2, ("future".into(), new.clone()));
                vec![Value::Map(entries)]
            }
            _ => Vec::new(),
        });
        for extended in extended {
            assert_eq!(decode(&golden.message, &extended).as_deref(), Ok(&plain[..]), "{}", golden.file);
        }
    }
}

/// Those of the golden `social`, `other_choice`, `degraded_by` and `metrics`.
fn is_measure(key: &Value) -> bool {
    let is_sample = |name: &str| name.starts_with("curionav_");
    let is_code = |name: &str| [Degradation::VARIANTS, Reason::VARIANTS].concat().contains(&name);
    let is_social = |name: &str| ["spl", "personal_share"].contains(&name);
    key.as_text().is_some_and(|name| is_social(name) || is_code(name) || is_sample(name))
}

fn is_data(entry: &Value) -> bool {
    entry.is_tag() || entry.as_text().is_some_and(|text| ["pool", "local", "none"].contains(&text))
}

#[test]
fn a_message_cut_short_or_followed_by_more_is_refused() {
    for golden in goldens() {
        for end in 0..golden.bytes.len() {
            let error = recode(&golden.message, &golden.bytes[..end], None).unwrap().expect_err(&golden.file);
            assert!(matches!(error.why, Refusal::Malformed { .. }), "{}: {error}", golden.file);
        }
        let longer = [&golden.bytes[..], &[0xf6]].concat();
        assert!(recode(&golden.message, &longer, None).unwrap().is_err(), "{}", golden.file);
    }
}

#[test]
fn an_oversize_message_is_refused_before_it_is_parsed() {
    for message in MESSAGES {
        let zeros = vec![0; message.max_bytes + 1];
        let error = recode(message.name, &zeros, Some("not even our encoding")).unwrap().unwrap_err();
        let most = message.max_bytes as u64;
        assert_eq!(error.why, Refusal::Oversize { found: most + 1, most });
    }
}

#[test]
fn declared_lengths_beyond_the_message_are_refused() {
    // Byte string, text, array and map of 2^62 and of 2^32 - 1 elements, alone and as the value of a field.
    for major in [0x40, 0x60, 0x80, 0xa0_u8] {
        for head in
            [[&[major | 27][..], &[0x40, 0, 0, 0, 0, 0, 0, 0]].concat(), vec![major | 26, 255, 255, 255, 255]]
        {
            let field = [&[0xa1, 0x64][..], b"tick", &head].concat();
            for bytes in [&head, &field] {
                let error = Twist::decode(bytes, None).unwrap_err();
                assert!(matches!(error.why, Refusal::Malformed { .. }), "{bytes:x?}: {error}");
            }
        }
    }
}

#[test]
fn deep_nesting_and_indefinite_lengths_are_refused() {
    for initial in [0x81, 0xc1, 0xd8] {
        let bytes = vec![initial; 100];
        assert!(matches!(Twist::decode(&bytes, None).unwrap_err().why, Refusal::Malformed { .. }));
    }
    let nested = |depth| (0..depth).fold(Value::Null, |inner, _| Value::Array(vec![inner]));
    let within = |depth| {
        let Value::Map(mut entries) = parse(&golden::<Twist>().encode()) else { panic!() };
        entries.push(("future".into(), nested(depth)));
        Twist::decode(&write(&Value::Map(entries)), None)
    };
    // The message itself is one level.
    assert!(within(MAX_DEPTH - 1).is_ok());
    assert!(within(MAX_DEPTH).is_err());
    assert!(Twist::decode(&[0xbf, 0xff], None).unwrap_err().to_string().contains("indefinite"));
}

#[test]
fn a_key_given_twice_is_refused() {
    let Value::Map(mut entries) = parse(&golden::<Twist>().encode()) else { panic!() };
    entries.push(entries[0].clone());
    assert!(Twist::decode(&write(&Value::Map(entries)), None).unwrap_err().to_string().contains("duplicate"));
}

#[test]
fn a_map_cannot_stand_for_a_plain_value() {
    for golden in goldens() {
        let wrong = changed(&fixed_form(parse(&golden.bytes)), &|value| match value {
            Value::Text(text) => vec![Value::Map(vec![(text.as_str().into(), Value::Null)])],
            _ => Vec::new(),
        });
        for wrong in wrong {
            assert!(decode(&golden.message, &wrong).is_err(), "{}: {wrong:?}", golden.file);
        }
    }
}

#[test]
fn the_encoding_string_must_name_the_message_and_version() {
    let bytes = golden::<Scan>().encode();
    assert!(Scan::decode(&bytes, Some("application/cbor;curionav.scan.v1")).is_ok());
    let of = |message: &str| format!("application/cbor;curionav.{message}");
    let others = ["", "application/cbor", "zenoh/bytes", "application/json;curionav.scan.v1"];
    for found in others.map(str::to_owned).into_iter().chain([of("scan.v2"), of("twist.v1")]) {
        let error = Scan::decode(&bytes, Some(&found)).unwrap_err();
        assert_eq!(error.why, Refusal::WrongEncoding { found, expected: of("scan.v1") });
    }
}

#[test]
fn a_refusal_names_the_field_at_fault() {
    let mut status: RunStatus = golden();
    status.result.as_mut().unwrap().trace.people.present.0[1] = 7;
    let error = RunStatus::decode(&status.encode(), None).unwrap_err();
    assert_eq!(error.field.as_deref(), Some("result.trace.people.present[1]"));
    let missing = MissionCommand::decode(&write(&Value::Map(vec![("kind".into(), "goal".into())])), None);
    assert!(missing.unwrap_err().to_string().contains("`goal` needs `x`"));
}

#[test]
fn a_code_of_a_later_version_reads_as_unknown() {
    let later = Value::Map(vec![("code".into(), "from_the_future".into()), ("found".into(), 3.into())]);
    let reject = Value::Map(vec![("why".into(), later)]);
    assert_eq!(Reject::decode(&write(&reject), None).unwrap().why, Refusal::Unknown);
}

proptest! {
    #[test]
    fn random_bytes_never_panic(bytes in prop::collection::vec(any::<u8>(), 0..512)) {
        for message in MESSAGES {
            let _ = recode(message.name, &bytes, None);
        }
    }

    #[test]
    fn random_candidate_sets_survive_a_round_trip(
        (steps, x, dt) in (1..20_u32, 0..40_u32).prop_flat_map(|(steps, count)| {
            let x = prop::collection::vec(-1e12..1e12, (steps * count) as usize);
            (Just(steps), x, f64::MIN_POSITIVE..1e3)
        }),
    ) {
        let array = |offset: f64| x.iter().map(|x| x * 0.5 + offset).collect::<F64Array>();
        let count = x.len() as u32 / steps;
        let set = CandidateSet {
            count, steps, dt,
            id: (0..count).rev().collect(),
            y: array(0.1), heading: array(0.0), v: array(-1.0), omega: array(3.0),
            x: x.into(),
        };
        prop_assert_eq!(CandidateSet::decode(&set.encode(), Some(CandidateSet::ENCODING)), Ok(set));
    }
}
