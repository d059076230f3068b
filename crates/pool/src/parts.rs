//! Which part of the candidates a replica gets, and the question in which a generator sends it.

use std::ops::Range;

use curionav_planning::candidates::CandidateSet;
use curionav_planning::terms;
use curionav_runtime::convert;
use curionav_schemas::{Fields, Forward, ForwardTo, GenerateRequest};

/// Room for the fields that every question has of its own, with their names, bytes.
const OWN_FIELDS: usize = 1024;

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
pub(crate) fn part_of(count: usize, (start, end): (f64, f64)) -> Range<usize> {
    let at = |share: f64| ((share * count as f64).round() as usize).min(count);
    at(start)..at(end)
}

/// What the questions of a generator to evaluators have in common.
pub struct ForwardedFields(Fields);

impl ForwardedFields {
    /// For those that `request` asks for.
    pub fn new(request: &GenerateRequest, forward: &Forward) -> Self {
        Self(
            Fields::default()
                .with("epoch", &request.epoch)
                .with("seq", &request.seq)
                .with("budget_ms", &forward.budget_ms)
                .with("map", &request.map)
                .with("goal_x", &request.goal_x)
                .with("goal_y", &request.goal_y)
                .with("laser", &request.laser)
                .with("robot_model", &request.robot_model)
                .with("odometry_noise", &forward.odometry_noise)
                .with("scene", &request.scene),
        )
    }

    /// Who is to be asked, and what, for those whose part has candidates.
    pub fn questions<'a>(
        &'a self,
        to: &'a [ForwardTo],
        candidates: &'a CandidateSet,
    ) -> impl Iterator<Item = (&'a ForwardTo, Vec<u8>)> {
        to.iter().filter_map(move |to| Some((to, self.question(to, candidates)?)))
    }

    /// The question about a part of the candidates, an encoded [`EvaluateRequest`](curionav_schemas::EvaluateRequest).
    fn question(&self, to: &ForwardTo, candidates: &CandidateSet) -> Option<Vec<u8>> {
        let range = part_of(candidates.len(), (to.start, to.end));
        if range.is_empty() {
            return None;
        }
        let shard = convert::shard_to_wire(candidates, range, terms::columns(&to.term));
        let fields = Fields::with_room(self.0.encoded_len() + shard.array_bytes() + OWN_FIELDS)
            .and(&self.0)
            .with("shard", &to.shard)
            .with("params", &to.params)
            .with("candidates", &shard);
        Some(fields.into_bytes())
    }
}

#[cfg(test)]
mod tests {
    use curionav_schemas::{EvaluateRequest, Message};
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
    fn a_forwarded_question_says_what_the_arbiter_would_ask() {
        let request = golden::generate_request_to_forward();
        let forward = request.forward.clone().unwrap();
        let candidates = convert::candidates(golden::candidate_set()).unwrap();
        let fields = ForwardedFields::new(&request, &forward);
        let to =
            |term: &str, start, end| ForwardTo { term: term.into(), start, end, ..forward.to[0].clone() };
        let read = |bytes: Vec<u8>| EvaluateRequest::decode(&bytes, None).unwrap();
        let whole = read(fields.question(&to("cpc", 0.0, 1.0), &candidates).unwrap());
        let expected = EvaluateRequest {
            shard: forward.to[0].shard,
            budget_ms: forward.budget_ms,
            params: forward.to[0].params.clone(),
            ..golden::evaluate_request()
        };
        assert_eq!(whole, expected);
        let second = read(fields.question(&to("cnc", 0.5, 1.0), &candidates).unwrap()).candidates;
        assert_eq!((second.count, &second.id[..]), (1, &whole.candidates.id[1..]));
        assert_eq!((second.heading, second.v, second.omega), (None, None, None));
        assert_eq!(fields.question(&to("cnc", 0.5, 0.5), &candidates), None);
        assert_eq!(fields.question(&to("cnc", 1.0, 0.0), &candidates), None);
    }
}
