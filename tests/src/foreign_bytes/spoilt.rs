//! Payloads that no reader may take for a message.

use curionav_planning::random::{Rng, uniform};
use curionav_schemas::{MESSAGES, recode};
use curionav_testing::golden;

/// Messages with a limit below this are also sent too large.
const OVERSIZE_UP_TO: usize = 256 * 1024;

/// Bytes and the encoding that comes with them.
#[derive(Debug, Clone)]
pub(super) struct Spoilt {
    pub(super) bytes: Vec<u8>,
    pub(super) encoding: String,
}

/// A number below `n`.
pub(super) fn below(rng: &mut Rng, n: usize) -> usize {
    ((uniform(rng) * n as f64) as usize).min(n - 1)
}

fn noise(rng: &mut Rng, most: usize) -> Vec<u8> {
    (0..1 + below(rng, most)).map(|_| below(rng, 256) as u8).collect()
}

fn encoding_of(message: &str) -> String {
    format!("application/cbor;curionav.{message}.v1")
}

/// Something that is not `message`, made from it in one of many ways.
pub(super) fn spoilt(rng: &mut Rng, message: &str) -> Spoilt {
    loop {
        let spoilt = attempt(rng, message);
        // Some changes leave a message that a service might have sent; one without an encoding may come without.
        let encoding = (!spoilt.encoding.is_empty()).then_some(&*spoilt.encoding);
        if recode(message, &spoilt.bytes, encoding).is_none_or(|read| read.is_err()) {
            return spoilt;
        }
    }
}

fn attempt(rng: &mut Rng, message: &str) -> Spoilt {
    let examples: Vec<Vec<u8>> =
        golden::all().into_iter().filter(|g| g.message == message).map(|g| g.bytes).collect();
    let mut encoding = encoding_of(message);
    let bytes =
        if examples.is_empty() { noise(rng, 64) } else { examples[below(rng, examples.len())].clone() };
    let at = below(rng, bytes.len());
    let (head, tail) = bytes.split_at(at);
    let limit = MESSAGES.iter().find(|m| m.name == message).map_or(0, |m| m.max_bytes);
    let bytes = match below(rng, 10) {
        0 => noise(rng, 2048),
        1 => flipped(rng, bytes),
        2 => head.to_vec(),
        3 => [&bytes[..], &noise(rng, 64)].concat(),
        4 => not_a_number(rng, bytes),
        // A byte string, an array or a map of 2^63 items and more, where there was something else.
        5 => [head, &[[0x5b, 0x9b, 0xbb][below(rng, 3)], 0x80, 0, 0, 0, 0, 0, 0, 1], tail].concat(),
        // Nested deeper than anything.
        6 => vec![0x81; 1 + below(rng, 4096)],
        7 if limit > 0 && limit <= OVERSIZE_UP_TO => vec![0; limit + 1],
        8 => {
            encoding = encoding.replace(".v1", ".v2");
            bytes
        }
        _ => {
            let other = MESSAGES[below(rng, MESSAGES.len())].encoding;
            encoding = [other, "", "application/json", &"x".repeat(200)][below(rng, 4)].to_owned();
            bytes
        }
    };
    Spoilt { bytes, encoding }
}

fn flipped(rng: &mut Rng, mut bytes: Vec<u8>) -> Vec<u8> {
    for _ in 0..1 + below(rng, 16) {
        let at = below(rng, bytes.len());
        bytes[at] ^= 1 << below(rng, 8);
    }
    bytes
}

/// One number of eight bytes becomes none.
fn not_a_number(rng: &mut Rng, mut bytes: Vec<u8>) -> Vec<u8> {
    let floats: Vec<usize> = (0..bytes.len().saturating_sub(8)).filter(|i| bytes[*i] == 0xfb).collect();
    if floats.is_empty() {
        return flipped(rng, bytes);
    }
    let at = floats[below(rng, floats.len())] + 1;
    let value = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY][below(rng, 3)];
    bytes[at..at + 8].copy_from_slice(&value.to_be_bytes());
    bytes
}
