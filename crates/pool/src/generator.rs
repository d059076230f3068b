//! The trajectory generators in their two homes, as `evaluators` does for evaluators.

use std::time::Duration;

use curionav_planning::generation::{self, GenerationInput, GenerationParams, GeneratorPart};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::parameters::Range;
use curionav_planning::terms::DerivedFields;
use curionav_runtime::convert;
use curionav_runtime::process::{Running, Start};
use curionav_runtime::serve::Asked;
use curionav_schemas::{GenerateReply, GenerateRequest, Refusal, Reject, keys};

use crate::pool_service;
use curionav_runtime::fields::Fields;

curionav_planning::parameters! {
    /// Parameters of one generation as they travel.
    pub struct GeneratorParams {
        /// What the profile says.
        pub profile: GeneratorPart [table],
        /// Where the last decision leads from here, (x, y, heading) per state; empty if nowhere.
        pub previous: Vec<[f64; 3]> [
            in Range::POSITION, Range::POSITION, Range::HEADING; 0.0, 256.0, "a decision has no more states"
        ],
    }
}

/// Serves questions. A request for no growth warms the replica: it is answered once every field the request
/// would need is there.
pub fn run(start: Start<'_>) -> Running<'_> {
    let instance = start.config.instance.clone();
    let answer = move |fields: &Fields, request: GenerateRequest, asked: Asked<'_>| {
        let reply = answer(&instance, fields, request, &|| asked.came.elapsed())?;
        Ok((reply.candidates.count as usize, reply))
    };
    let budget = |request: &GenerateRequest| {
        (request.iterations > 0).then(|| Duration::from_millis(request.budget_ms.into()))
    };
    Box::pin(pool_service::run(keys::GENERATOR, "Candidates offered", start, budget, answer))
}

/// The answer of `instance` within the budget of `request`, of which some has `elapsed`. A request for no growth
/// derives what such requests need; any other for which it has not been derived is refused as cold, at once.
pub fn answer(
    instance: &str,
    fields: &Fields,
    request: GenerateRequest,
    elapsed: &dyn Fn() -> Duration,
) -> Result<GenerateReply, Reject> {
    let budget = Duration::from_millis(request.budget_ms.into()).as_secs_f64().max(1e-6);
    let spent = || elapsed().as_secs_f64() / budget;
    let warms_up = request.iterations == 0;
    if !warms_up && spent() >= 1.0 {
        return Err(Refusal::Stopped.into());
    }
    let Some(kind) = generation::find(&request.generator) else {
        let known = generation::generator_names();
        return Err(Refusal::UnknownName { found: request.generator.clone(), known }.at("generator"));
    };
    let fields = if warms_up { fields.clone() } else { fields.kept() };
    let limit = |params: &mut GenerationParams| *(kind.iterations)(params) = request.iterations;
    let (generated, cut, took) = with_input(&fields, &request, limit, |input| {
        let started = elapsed();
        let tree = request.tree.clone().map(convert::tree);
        let (generated, cut) = kind.generate(input, tree, &spent);
        (generated, cut, elapsed() - started)
    })?;
    Ok(GenerateReply {
        epoch: request.epoch,
        seq: request.seq,
        instance: instance.to_owned(),
        candidates: convert::candidates_to_wire(&generated.candidates),
        tree: convert::tree_to_wire(generated.tree),
        elapsed_us: took.as_micros() as u64,
        cut,
    })
}

/// What `make` makes of a question, whose fields are derived or, if `fields` are those that are kept, have to be there.
/// `limit` sets what limits the work; it is within its range.
pub(crate) fn with_input<R>(
    fields: &Fields,
    request: &GenerateRequest,
    limit: impl FnOnce(&mut GenerationParams),
    make: impl FnOnce(&GenerationInput<'_>) -> R,
) -> Result<R, Reject> {
    let warms_up = request.iterations == 0;
    let scene = convert::scene(&request.scene);
    let here = scene.belief.pose.position();
    let fields = fields.of(request.map).obstructed(&scene.obstacles, here)?;
    let map = fields.map()?;
    let robot = convert::checked("robot_model", convert::robot_model(&request.robot_model))?;
    let goal = Point2::new(request.goal_x, request.goal_y);
    let geodesic = fields.geodesic(goal, robot.radius())?;
    let GeneratorParams { profile: mut params, previous } = convert::parameters("params", &request.params)?;
    let laser = convert::laser(&request.laser);
    let robot = robot.seeing_with(&laser);
    let looks = params.looks_for_landmarks();
    let information = looks.then(|| fields.information(laser, &params.information)).transpose()?;
    limit(&mut params.generation);
    let params = if warms_up { params } else { convert::checked("params.profile", params)? };
    let previous: Vec<Pose2> =
        previous.into_iter().map(|[x, y, heading]| Pose2::new(x, y, heading)).collect();
    Ok(make(&GenerationInput {
        params: &params,
        map: &map,
        goal,
        geodesic: &geodesic,
        information: information.as_deref(),
        robot: &robot,
        scene: &scene,
        previous: (!previous.is_empty()).then_some(&previous),
        seed: request.seed,
    }))
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
    use curionav_planning::profile::Profile;
    use curionav_schemas::MapId;
    use curionav_testing::golden;

    use super::*;

    /// An empty room of 12 m by 12 m, a question without a tree, and what its parameters take from the profile.
    fn first_question() -> (Fields, GenerateRequest, GeneratorPart) {
        let profile = Profile::builtin("curiosity").unwrap().generator_part();
        let params = GeneratorParams { profile: profile.clone(), previous: Vec::new() };
        let grid = OccupancyGrid::new(120, 120, 0.1, Pose2::new(-2.0, -3.0, 0.0), vec![0; 14_400]).unwrap();
        let request = GenerateRequest {
            map: MapId(grid.hash()),
            tree: None,
            params: convert::to_value(&params).unwrap(),
            ..golden::generate_request()
        };
        (Fields::of_maps([StaticMap::new(grid)]), request, profile)
    }

    #[test]
    fn more_iterations_than_a_profile_may_ask_for_are_refused() {
        let (fields, request, _) = first_question();
        let ask = |iterations: u32, generator: &str| {
            let request = GenerateRequest { iterations, generator: generator.into(), ..request.clone() };
            answer("a", &fields, request, &Duration::default)
        };
        for kind in generation::GENERATORS {
            ask(0, kind.name).unwrap();
            let refused = ask(u32::MAX, kind.name).unwrap_err();
            let field = refused.field.unwrap_or_default();
            assert!(field.starts_with("params.profile.generation."), "{}: {field}", kind.name);
        }
    }

    #[test]
    fn a_tree_that_the_budget_cuts_short_says_so() {
        let (fields, request, profile) = first_question();
        for kind in generation::GENERATORS {
            // What warms a replica up.
            let request = GenerateRequest { iterations: 0, generator: kind.name.into(), ..request.clone() };
            let tree = answer("a", &fields, request, &Duration::default).unwrap().tree;
            assert!(convert::tree(tree).is_sound(), "{}", kind.name);
        }
        let answered = |generator: &str, is_short: bool| {
            let kind = generation::find(generator).unwrap();
            let iterations = *(kind.iterations)(&mut profile.generation.clone());
            let request = GenerateRequest { iterations, generator: generator.into(), ..request.clone() };
            // A budget that is over when it is asked for the second time.
            let asked = Cell::new(false);
            let elapsed = || Duration::from_secs(u64::from(asked.replace(true) && is_short));
            let reply = answer("a", &fields, request, &elapsed).unwrap();
            assert_eq!(reply.cut, is_short, "{generator}");
            reply.tree.parent.len() + reply.candidates.count as usize
        };
        for generator in generation::GENERATORS.iter().map(|kind| kind.name) {
            let [short, whole] = [true, false].map(|is_short| answered(generator, is_short));
            // However many it tries, its sequence is as long and its best are as many.
            assert!(short < whole || generator == "mppi", "{generator}: {short} and {whole}");
        }
    }
}
