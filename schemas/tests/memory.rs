//! Whatever the bytes claim, reading them takes memory in proportion to their number. A binary of its own with one
//! test, because the meter counts the whole process.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use curionav_schemas::limits::MAX_ITEMS;
use curionav_schemas::{MESSAGES, Message, Mission, Refusal, recode};
use peak_alloc::PeakAlloc;
use proptest::prelude::*;
use proptest::sample::Index;
use proptest::test_runner::{Config, TestRunner};
use support::{golden, goldens};

mod support;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

/// Peak of memory in bytes while `bytes` are read as `message`, beyond what was in use before.
fn peak(message: &str, bytes: &[u8]) -> usize {
    let before = MEMORY.current_usage();
    MEMORY.reset_peak_usage();
    let _ = recode(message, bytes, None);
    MEMORY.peak_usage().saturating_sub(before)
}

/// One change to some bytes.
#[derive(Debug, Clone)]
enum Mutation {
    Flip(Index, u8),
    Insert(Index, Vec<u8>),
    Remove(Index, u8),
    Repeat(Index, u8),
}

fn mutation() -> impl Strategy<Value = Mutation> {
    let claims = prop::sample::select(vec![
        vec![0x5b, 0x7f, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff, 0xff],
        vec![0x9a, 0xff, 0xff, 0xff, 0xff],
        vec![0xba, 0x7f, 0xff, 0xff, 0xff],
        vec![0x9f],
        vec![0xd8, 0x56],
        vec![0xfb, 0x7f, 0xf8, 0, 0, 0, 0, 0, 0],
    ]);
    prop_oneof![
        (any::<Index>(), 1..=255_u8).prop_map(|(at, bits)| Mutation::Flip(at, bits)),
        (any::<Index>(), claims).prop_map(|(at, bytes)| Mutation::Insert(at, bytes)),
        (any::<Index>(), any::<u8>()).prop_map(|(at, count)| Mutation::Remove(at, count)),
        (any::<Index>(), any::<u8>()).prop_map(|(at, count)| Mutation::Repeat(at, count)),
    ]
}

fn mutate(bytes: &mut Vec<u8>, mutation: &Mutation) {
    if bytes.is_empty() {
        return;
    }
    let run = |at: &Index, count: u8| {
        at.index(bytes.len())..(at.index(bytes.len()) + usize::from(count)).min(bytes.len())
    };
    match mutation {
        Mutation::Flip(at, bits) => {
            let at = at.index(bytes.len());
            bytes[at] ^= bits;
        }
        Mutation::Insert(at, more) => {
            let at = at.index(bytes.len());
            bytes.splice(at..at, more.iter().copied());
        }
        Mutation::Remove(at, count) => drop(bytes.drain(run(at, *count))),
        Mutation::Repeat(at, count) => {
            let piece = bytes[run(at, *count)].to_vec();
            let at = at.index(bytes.len());
            bytes.splice(at..at, piece);
        }
    }
}

#[test]
fn reading_takes_memory_in_proportion_to_the_bytes() {
    // Lengths that the message does not have: nothing is reserved for them.
    for message in MESSAGES {
        for head in [[0x5b_u8, 0, 0, 0, 0xff], [0x9b, 0, 0, 0, 0xff], [0xbb, 0, 0, 0, 0xff]] {
            let bytes = [&head[..], &[0; 4]].concat();
            assert!(peak(message.name, &bytes) < 4096, "{}", message.name);
        }
    }

    // The most expensive honest content, byte for byte, is free-form parameters of empty lists.
    let list = |count: usize| ciborium::Value::Array(vec![ciborium::Value::Array(Vec::new()); count]);
    let bloated = |count| {
        let profile = ciborium::Value::Map(vec![("list".into(), list(count))]);
        let mut mission = golden::<Mission>();
        mission.order.profile = profile;
        mission.encode()
    };
    assert!(Mission::decode(&bloated(MAX_ITEMS - 200), None).is_ok());
    assert!(matches!(Mission::decode(&bloated(MAX_ITEMS), None).unwrap_err().why, Refusal::Malformed { .. }));
    let most = peak("mission", &bloated(MAX_ITEMS - 200));
    assert!(most < 8 << 20, "{most} bytes");

    // Damaged messages.
    let goldens = goldens();
    let damaged = (0..goldens.len(), prop::collection::vec(mutation(), 1..6));
    let mut runner =
        TestRunner::new(Config { cases: 20_000, failure_persistence: None, ..Config::default() });
    let outcome = runner.run(&damaged, |(index, mutations)| {
        let mut bytes = goldens[index].bytes.clone();
        mutations.iter().for_each(|mutation| mutate(&mut bytes, mutation));
        let peak = peak(&goldens[index].message, &bytes);
        // Scratch, the values, their encoding, texts of errors, and growth of each by doubling.
        prop_assert!(peak < 64 * 1024 + 32 * bytes.len(), "{peak} bytes to read {}", bytes.len());
        Ok(())
    });
    outcome.unwrap();
}
