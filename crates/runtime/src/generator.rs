//! The trajectory generators in their two homes, as `evaluators` does for evaluators.

use std::cell::Cell;
use std::sync::Arc;
use std::time::Instant;

use curionav_planning::collision::CollisionParams;
use curionav_planning::collision_risk::RiskParams;
use curionav_planning::forecast::ForecastParams;
use curionav_planning::generation::{self, GenerationInput, GenerationParams};
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::{GeodesicField, StaticMap};
use curionav_schemas::{GenerateReply, GenerateRequest, Reject, RejectCode};
use serde::{Deserialize, Serialize};

use crate::convert;
use crate::fields::Fields;

/// Role under which generators announce themselves.
pub const ROLE: &str = "generator";

/// Names of the generators there are, for messages.
pub fn known() -> String {
    generation::NAMES.join(", ")
}

/// Whether a generator of that name exists.
pub fn is_known(name: &str) -> bool {
    generation::NAMES.contains(&name)
}

/// Parameters of one generation, all from the profile, so that any replica computes the same.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct GeneratorParams {
    /// States per candidate.
    pub steps: usize,
    /// Seconds between states.
    pub dt: f64,
    /// Average speed below which a candidate counts as slow, m/s (D4).
    pub min_speed: f64,
    /// The tree and its candidates.
    pub generation: GenerationParams,
    /// How much room is kept.
    pub collision: CollisionParams,
    /// How the baselines weigh risk.
    pub risk: RiskParams,
    /// How people move on.
    pub forecast: ForecastParams,
    /// Where the last decision leads from here, (x, y, heading) a state; empty if nowhere.
    pub previous: Vec<[f64; 3]>,
}

/// Distance to go for the request's goal and robot.
fn geodesic(fields: &Fields, request: &GenerateRequest) -> Result<Arc<GeodesicField>, Reject> {
    let radius = convert::robot_model(&request.robot_model).radius();
    fields.geodesic(request.map, Point2::new(request.goal_x, request.goal_y), radius)
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
        return Err(Reject::new(RejectCode::Stopped, "its time was over before a slot was free"));
    }
    let fields = if warms_up { fields.clone() } else { fields.kept() };
    let map = fields.map(request.map)?;
    let geodesic = geodesic(&fields, request)?;
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
    let mut params: GeneratorParams = convert::from_value("params", &request.params)?;
    let generation = &mut params.generation;
    generation.tree.iterations = request.iterations;
    generation.risk_rrt.nodes = request.iterations;
    generation.collision = params.collision;
    generation.risk = params.risk;
    generation.candidates.steps = params.steps as u32;
    generation.candidates.dt = params.dt;
    generation.candidates.slow = params.min_speed;
    let checked = generation.risk_rrt.check().and_then(|()| generation.bi_risk_rrt.check());
    checked.map_err(|(field, message)| Reject::invalid(format!("params.{field}"), message))?;
    let Some(generator) = generation::by_name(&request.generator, params.generation) else {
        let reason = format!("`{}` is not a trajectory generator; known: {}", request.generator, known());
        return Err(Reject::new(RejectCode::Unknown, reason));
    };
    let robot = convert::robot_model(&request.robot_model);
    let scene = convert::scene(&request.scene)?;
    let previous: Vec<Pose2> =
        params.previous.iter().map(|[x, y, heading]| Pose2::new(*x, *y, *heading)).collect();
    let input = GenerationInput {
        map,
        goal: Point2::new(request.goal_x, request.goal_y),
        geodesic,
        robot: &robot,
        scene: &scene,
        forecast: params.forecast,
        previous: (!previous.is_empty()).then_some(&previous),
    };
    // Whoever is told to stop does.
    let cut = Cell::new(false);
    let should_stop = || {
        cut.set(cut.get() || should_stop());
        cut.get()
    };
    let generated =
        generator.generate(&input, request.tree.clone().map(convert::tree), request.seed, &should_stop);
    Ok(GenerateReply {
        epoch: request.epoch,
        seq: request.seq,
        instance: instance.to_owned(),
        candidates: convert::candidates_to_wire(&generated.candidates),
        tree: convert::tree_to_wire(generated.tree),
        elapsed_us: started.elapsed().as_micros() as u64,
        cut: cut.get(),
    })
}

#[cfg(test)]
mod tests {
    use curionav_planning::occupancy::OccupancyGrid;
    use curionav_planning::profile::Profile;
    use curionav_schemas::golden;

    use super::*;

    #[test]
    fn a_tree_that_the_budget_cuts_short_says_so() {
        let profile = Profile::builtin("curiosity").unwrap();
        let params = GeneratorParams {
            steps: profile.steps,
            dt: profile.dt,
            min_speed: profile.min_speed,
            generation: profile.generation.clone(),
            collision: profile.collision,
            risk: profile.risk,
            forecast: profile.forecast,
            previous: Vec::new(),
        };
        // An empty room of 12 m by 12 m.
        let grid = OccupancyGrid::new(120, 120, 0.1, Pose2::new(-2.0, -3.0, 0.0), vec![0; 14_400]).unwrap();
        let map = StaticMap::new(grid);
        let request = GenerateRequest {
            tree: None,
            params: convert::to_value(&params).unwrap(),
            ..golden::generate_request()
        };
        let goal = Point2::new(request.goal_x, request.goal_y);
        let geodesic = GeodesicField::new(&map.grid, &map.to_obstacle, goal, 0.3);
        let nodes = |generator: &str, is_over: bool| {
            let request = GenerateRequest { generator: generator.into(), ..request.clone() };
            let reply = generate("a", &request, &map, &geodesic, &|| is_over).unwrap();
            assert_eq!(reply.cut, is_over, "{generator}");
            reply.tree.x.len()
        };
        for generator in generation::NAMES {
            assert!(nodes(generator, true) < nodes(generator, false), "{generator}");
        }
    }
}
