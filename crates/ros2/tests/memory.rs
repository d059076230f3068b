//! No bytes make the reader panic, or allocate much more than there are bytes. A binary of its own with one test,
//! because the meter counts the whole process.

#![allow(clippy::unwrap_used, reason = "a test that cannot go on stops")]

use std::panic::catch_unwind;

use curionav_ros2::testing::{Rng, TYPES};
use peak_alloc::PeakAlloc;

#[global_allocator]
static MEMORY: PeakAlloc = PeakAlloc;

const SEED: u64 = 16;

/// `payload` with something wrong in it.
fn spoilt(rng: &mut Rng, payload: &[u8]) -> Vec<u8> {
    let at = rng.below(payload.len());
    match rng.below(5) {
        0 => payload[..at].to_vec(),
        1 => {
            let mut flipped = payload.to_vec();
            (0..1 + rng.below(8)).for_each(|_| {
                let at = rng.below(flipped.len());
                flipped[at] ^= 1 << rng.below(8);
            });
            flipped
        }
        // A length of four thousand million, or of more than is there.
        2 => [&payload[..at], &[0xff; 4], &payload[at..]].concat(),
        3 => [&payload[..at], &[rng.below(256) as u8, rng.below(256) as u8, 0, 0], &payload[at..]].concat(),
        _ => (0..rng.below(300)).map(|_| rng.below(256) as u8).collect(),
    }
}

#[test]
fn no_bytes_make_it_panic_or_allocate_more_than_a_few_times_their_number() {
    println!("seed {SEED}");
    let mut rng = Rng::new(SEED);
    for of in TYPES {
        for _ in 0..2000 {
            let sent = (of.random)(&mut rng).unwrap();
            let payload = spoilt(&mut rng, &sent);
            MEMORY.reset_peak_usage();
            let before = MEMORY.current_usage();
            let read = catch_unwind(|| (of.recode)(&payload).map(|again| again.len()));
            let took = MEMORY.peak_usage().saturating_sub(before);
            assert!(read.is_ok(), "{}: {payload:02x?}", of.name);
            assert!(took < 16 * payload.len() + (1 << 16), "{}: {took} bytes for {}", of.name, payload.len());
        }
    }
}
