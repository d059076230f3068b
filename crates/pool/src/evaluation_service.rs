//! One evaluator as a service.

use std::time::Duration;

use curionav_planning::terms;
use curionav_runtime::convert;
use curionav_runtime::process::{Running, Start};
use curionav_runtime::serve::Asked;
use curionav_schemas::{EvaluateRequest, Refusal, Reject, Scores};

use crate::evaluators::evaluator;
use crate::pool_service;
use curionav_runtime::fields::Fields;

/// Serves `term`. A request without candidates warms the replica: it is answered once every field the request would
/// need is there.
pub fn run<'a>(term: &'static str, start: Start<'a>) -> Running<'a> {
    let instance = start.config.instance.clone();
    let slots = start.config.slots as u32;
    let answer = move |fields: &Fields, request: EvaluateRequest, asked: Asked<'_>| {
        let scores = answer(term, &instance, fields, request, slots, &|| asked.came.elapsed())?;
        Ok((scores.cost.len(), scores))
    };
    let budget = |request: &EvaluateRequest| {
        (request.candidates.count > 0).then(|| Duration::from_millis(request.budget_ms.into()))
    };
    Box::pin(pool_service::run(term, "Candidates scored", start, budget, answer))
}

/// The scores of `instance`, which has so many `slots`, within the budget of `request`, of which some has `elapsed`. A
/// request without candidates derives what such requests need; one with candidates for which it has not been derived is
/// refused as cold, at once.
pub fn answer(
    term: &str,
    instance: &str,
    fields: &Fields,
    request: EvaluateRequest,
    slots: u32,
    elapsed: &dyn Fn() -> Duration,
) -> Result<Scores, Reject> {
    let budget = Duration::from_millis(request.budget_ms.into());
    let should_stop = || elapsed() > budget;
    let warms_up = request.candidates.count == 0;
    if !warms_up && should_stop() {
        return Err(Refusal::Stopped.into());
    }
    let evaluator =
        if warms_up { evaluator(term, &request, fields) } else { evaluator(term, &request, &fields.kept()) }?;
    let epoch = request.epoch;
    let seq = request.seq;
    let shard = request.shard;
    let scene = convert::scene(&request.scene);
    let candidates = convert::shard(request.candidates, term, terms::columns(term))?;
    let begun = elapsed();
    let cost = evaluator.evaluate(&scene, &candidates, &should_stop).map_err(|_| Refusal::Stopped)?;
    Ok(Scores {
        epoch,
        seq,
        shard,
        term: term.to_owned(),
        instance: instance.to_owned(),
        cost: cost.into(),
        elapsed_us: (elapsed() - begun).as_micros() as u64,
        slots,
    })
}

#[cfg(test)]
mod tests {
    use curionav_planning::candidates::CandidateSet;
    use curionav_planning::geometry::{Point2, Pose2};
    use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
    use curionav_planning::profile::Profile;
    use curionav_planning::terms::Task;
    use curionav_schemas::{CandidateShard, MapId, Message};
    use curionav_testing::golden;

    use super::*;
    use crate::evaluators::parameters;

    /// What comes of two candidates under `term`.
    fn answered(term: &str, candidates: CandidateShard) -> Result<Scores, Reject> {
        let grid = OccupancyGrid::new(120, 120, 0.1, Pose2::new(-2.0, -3.0, 0.0), vec![0; 14_400]).unwrap();
        let params = parameters(&Profile::builtin("curiosity").unwrap(), term).unwrap();
        let request =
            EvaluateRequest { map: MapId(grid.hash()), params, candidates, ..golden::evaluate_request() };
        let fields = Fields::of_maps([StaticMap::new(grid)]);
        let none = CandidateSet::empty(3, 0.3);
        let none = convert::candidates_to_wire(&none).into();
        let warm_up = EvaluateRequest { candidates: none, ..request.clone() };
        let ask = |request| answer(term, "a", &fields, request, 1, &|| Duration::ZERO);
        ask(warm_up)?;
        ask(request)
    }

    #[test]
    fn a_column_that_a_term_reads_is_asked_for_by_name_and_no_other_is() {
        let all: CandidateShard = golden::candidate_set().into();
        let whole = answered("cpc", all.clone()).unwrap();
        assert_eq!(whole.cost.len(), 2);
        let lacks = |shard: CandidateShard| answered("cpc", shard).unwrap_err().to_string();
        let said = |column: &str| format!("candidates.{column}: is missing, and the term `cpc` reads it");
        assert_eq!(lacks(CandidateShard { heading: None, ..all.clone() }), said("heading"));
        assert_eq!(lacks(CandidateShard { v: None, ..all.clone() }), said("v"));
        assert_eq!(lacks(CandidateShard { omega: None, ..all.clone() }), said("omega"));

        let positions = CandidateShard { heading: None, v: None, omega: None, ..all.clone() };
        assert_eq!(answered("cnc", positions).unwrap().cost, answered("cnc", all).unwrap().cost);
    }

    #[test]
    fn what_comes_back_over_the_wire_is_what_the_arbiter_computes_bit_for_bit() {
        // A wall 3.5 m ahead, and one of the people of the example before it.
        let cells = (0..14_400).map(|cell| if (75..78).contains(&(cell % 120)) { 100 } else { 0 }).collect();
        let grid = OccupancyGrid::new(120, 120, 0.1, Pose2::new(-2.0, -3.0, 0.0), cells).unwrap();
        let profile = Profile::builtin("curionav").unwrap();
        let map = MapId(grid.hash());
        let fields = Fields::of_maps([StaticMap::new(grid)]);
        let cost = |term: &str| {
            let params = parameters(&profile, term).unwrap();
            let request = EvaluateRequest { map, params, ..golden::evaluate_request() };
            let request = EvaluateRequest::decode(&request.encode(), None).unwrap();
            let task = Task {
                goal: Point2::new(8.0, 6.5),
                goal_heading: None,
                robot: convert::robot_model(&golden::evaluate_request().robot_model),
                laser: convert::laser(&golden::evaluate_request().laser),
                noise: convert::noise(&golden::evaluate_request().odometry_noise),
            };
            let here = terms::evaluator(term, &profile, &task, &fields.of(map)).unwrap().unwrap();
            let scene = convert::scene(&golden::scene());
            let set = convert::candidates(golden::candidate_set());
            let here = here.evaluate(&scene, &set.unwrap(), &|| false).unwrap();
            let there = answer(term, "a", &fields, request, 1, &|| Duration::ZERO).unwrap().cost;
            assert_eq!(
                there.iter().map(|cost| cost.to_bits()).collect::<Vec<_>>(),
                here.iter().map(|cost| cost.to_bits()).collect::<Vec<_>>(),
                "{term}"
            );
            here
        };
        // Behind the wall others do not count.
        cost("cnc");
        let plain = cost("cpc");
        let occluded = cost("cpc-occluded");
        assert!(
            plain.iter().zip(&occluded).all(|(plain, occluded)| plain < occluded),
            "{plain:?} {occluded:?}"
        );
    }
}
