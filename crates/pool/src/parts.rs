//! Which part of the candidates a replica gets, and the message in which a generator sends it.

use std::ops::Range;

use curionav_planning::candidates::CandidateSet;
use curionav_planning::terms;
use curionav_runtime::convert;
use curionav_schemas::{Fields, OfferTo};

/// Room for what is in an offer besides arrays, bytes.
const OWN_FIELDS: usize = 256;

/// The shares of the candidates that slots get, from 0 to 1: contiguous, and proportional to the slots' speeds.
pub(crate) fn shares(speeds: &[f64]) -> Vec<(f64, f64)> {
    let total: f64 = speeds.iter().sum();
    let (mut covered, mut start) = (0.0, 0.0);
    let share = |(index, speed): (usize, &f64)| {
        covered += speed;
        let end = if index + 1 == speeds.len() { 1.0 } else { (covered / total).min(1.0) };
        (std::mem::replace(&mut start, end), end)
    };
    speeds.iter().enumerate().map(share).collect()
}

/// The candidates that make up a share of `count`; none if it ends before it begins.
pub(crate) fn part_of(count: usize, (from, to): (f64, f64)) -> Range<usize> {
    let at = |share: f64| ((share * count as f64).round() as usize).min(count);
    at(from)..at(to)
}

/// What goes to an evaluator that waits for its part of the candidates of a cycle (epoch and number): an encoded
/// [`Offer`](curionav_schemas::Offer); nothing if there are no candidates in its part.
pub fn offer((epoch, seq): (u64, u64), candidates: &CandidateSet, to: &OfferTo) -> Option<Vec<u8>> {
    let range = part_of(candidates.len(), (to.from, to.to));
    if range.is_empty() {
        return None;
    }
    let shard = convert::shard_to_wire(candidates, range, terms::columns(&to.term));
    let fields = Fields::with_room(shard.array_bytes() + OWN_FIELDS)
        .with("epoch", &epoch)
        .with("seq", &seq)
        .with("shard", &to.shard)
        .with("candidates", &shard);
    Some(fields.into_bytes())
}

#[cfg(test)]
mod tests {
    use curionav_schemas::{Message, Offer};
    use curionav_testing::golden;

    use super::*;

    fn parts(count: usize, speeds: &[f64]) -> Vec<Range<usize>> {
        shares(speeds).into_iter().map(|share| part_of(count, share)).collect()
    }

    #[test]
    fn parts_cover_every_candidate_once_whatever_the_speeds() {
        for count in [1, 15, 16, 31, 100, 2000] {
            for slots in 1..9 {
                let speeds: Vec<f64> = (0..slots).map(|i| 1.0 + f64::from(i * i) * 7.3).collect();
                let all: Vec<usize> = parts(count, &speeds).into_iter().flatten().collect();
                assert_eq!(all, (0..count).collect::<Vec<_>>(), "{count} over {slots}");
            }
        }
    }

    #[test]
    fn a_part_is_as_long_as_its_slot_is_fast() {
        assert_eq!(parts(100, &[1.0, 1.0, 1.0]), vec![0..33, 33..67, 67..100]);
        // 3 of 4 and 1 of 4
        assert_eq!(parts(100, &[300.0, 100.0]), vec![0..75, 75..100]);
    }

    #[test]
    fn an_offer_says_what_its_bytes_say_and_has_the_columns_that_its_term_reads() {
        let candidates = convert::candidates(golden::candidate_set()).unwrap();
        let to = |term: &str, from, to| OfferTo { term: term.into(), instance: "a".into(), shard: 3, from, to };
        let read = |bytes: Vec<u8>| Offer::decode(&bytes, None).unwrap();
        let whole = read(offer((2, 14), &candidates, &to("cpc", 0.0, 1.0)).unwrap());
        let expected = golden::candidate_set().into();
        assert_eq!(whole, Offer { epoch: 2, seq: 14, shard: 3, candidates: expected });
        let second = read(offer((2, 14), &candidates, &to("cnc", 0.5, 1.0)).unwrap()).candidates;
        assert_eq!((second.count, &second.id[..]), (1, &whole.candidates.id[1..]));
        assert_eq!((second.heading, second.v, second.omega), (None, None, None));
        assert_eq!(offer((2, 14), &candidates, &to("cnc", 0.5, 0.5)), None);
        assert_eq!(offer((2, 14), &candidates, &to("cnc", 1.0, 0.0)), None);
    }
}
