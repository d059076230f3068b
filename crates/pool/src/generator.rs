//! The trajectory generators in their two homes, as `evaluators` does for evaluators.

use std::time::Instant;

use curionav_planning::generation::{self, GenerationInput, GeneratorPart};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::{GeodesicField, StaticMap};
use curionav_planning::parameters::Range;
use curionav_schemas::{GenerateReply, GenerateRequest, Refusal, Reject};

use crate::fields::Fields;
use curionav_runtime::convert;

/// Role under which generators announce themselves.
pub use curionav_schemas::keys::GENERATOR as ROLE;

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

/// The answer of `instance`. A request for no growth derives what such requests need; any other for which
/// it has not been derived is refused as cold, at once.
pub fn answer(
    instance: &str,
    fields: &Fields,
    request: &GenerateRequest,
    should_stop: &dyn Fn() -> bool,
) -> Result<GenerateReply, Reject> {
    let warms_up = request.iterations == 0;
    if !warms_up && should_stop() {
        return Err(Refusal::Stopped.into());
    }
    let fields = if warms_up { fields.clone() } else { fields.kept() };
    let map = fields.map(request.map)?;
    let robot = convert::checked("robot_model", convert::robot_model(&request.robot_model))?;
    let goal = Point2::new(request.goal_x, request.goal_y);
    let geodesic = fields.geodesic(request.map, goal, robot.radius())?;
    generate(instance, request, &map, &geodesic, should_stop)
}

/// Computes the answer of `instance` from the fields it needs.
pub fn generate(
    instance: &str,
    request: &GenerateRequest,
    map: &StaticMap,
    geodesic: &GeodesicField,
    should_stop: &dyn Fn() -> bool,
) -> Result<GenerateReply, Reject> {
    let started = Instant::now();
    let GeneratorParams { profile: mut params, previous } = convert::parameters("params", &request.params)?;
    let Some(kind) = generation::find(&request.generator) else {
        let known = generation::known();
        return Err(Refusal::UnknownName { found: request.generator.clone(), known }.at("generator"));
    };
    *(kind.iterations)(&mut params.generation) = request.iterations;
    let robot = convert::checked("robot_model", convert::robot_model(&request.robot_model))?;
    let scene = convert::scene(&request.scene)?;
    let previous: Vec<Pose2> =
        previous.into_iter().map(|[x, y, heading]| Pose2::new(x, y, heading)).collect();
    let input = GenerationInput {
        params: &params,
        map,
        goal: Point2::new(request.goal_x, request.goal_y),
        geodesic,
        robot: &robot,
        scene: &scene,
        previous: (!previous.is_empty()).then_some(&previous),
        seed: request.seed,
    };
    let tree = request.tree.clone().map(convert::tree);
    let (generated, cut) = kind.generate(&input, tree, should_stop);
    Ok(GenerateReply {
        epoch: request.epoch,
        seq: request.seq,
        instance: instance.to_owned(),
        candidates: convert::candidates_to_wire(&generated.candidates),
        tree: convert::tree_to_wire(generated.tree),
        elapsed_us: started.elapsed().as_micros() as u64,
        cut,
    })
}

#[cfg(test)]
mod tests {
    use curionav_planning::occupancy::OccupancyGrid;
    use curionav_planning::profile::Profile;
    use curionav_testing::golden;

    use super::*;

    #[test]
    fn a_tree_that_the_budget_cuts_short_says_so() {
        let profile = Profile::builtin("curiosity").unwrap();
        let params = GeneratorParams { profile: profile.generator_part(), previous: Vec::new() };
        // An empty room of 12 m by 12 m.
        let grid = OccupancyGrid::new(120, 120, 0.1, Pose2::new(-2.0, -3.0, 0.0), vec![0; 14_400]).unwrap();
        let map = StaticMap::new(grid);
        let request = GenerateRequest {
            tree: None,
            params: convert::to_value(&params).unwrap(),
            ..golden::generate_request()
        };
        let goal = Point2::new(request.goal_x, request.goal_y);
        let geodesic = GeodesicField::new(&map, goal, 0.3);
        let nodes = |generator: &str, is_over: bool| {
            let request = GenerateRequest { generator: generator.into(), ..request.clone() };
            let reply = generate("a", &request, &map, &geodesic, &|| is_over).unwrap();
            assert_eq!(reply.cut, is_over, "{generator}");
            reply.tree.x.len()
        };
        for generator in generation::GENERATORS.iter().map(|kind| kind.name) {
            assert!(nodes(generator, true) < nodes(generator, false), "{generator}");
        }
    }
}
