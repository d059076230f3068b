//! From an injected scenario to a world and a mission.

use curionav_crowdsim::scenario::{Recorded, Scenario};
use curionav_crowdsim::{Recording, World};
use curionav_localization::LocalizerParams;
use curionav_planning::occupancy::{MapYaml, StaticMap, load_map};
use curionav_planning::parameters::{FieldError, Ranged, read_table};
use curionav_planning::profile::Profile;
use curionav_runtime::convert;
use curionav_schemas::{
    self as wire, Clock, InjectRequest, MapId, MissionOrder, Refusal, Reject, Value, words,
};

/// Roles that must report ready before a run starts.
const REQUIRED: [&str; 3] = ["arbiter", "driver", "localizer"];

/// What is wrong with an injected scenario: field, problem and mend.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[error("{field}: {problem}")]
pub struct InjectError {
    /// Path of the field.
    pub field: String,
    /// What is wrong and what would be right.
    pub problem: String,
}

impl From<InjectError> for Reject {
    fn from(error: InjectError) -> Self {
        Refusal::invalid(error.problem).at(error.field)
    }
}

impl From<FieldError> for InjectError {
    fn from(error: FieldError) -> Self {
        Self { field: error.field, problem: format!("{}; {}", error.problem, error.mend) }
    }
}

fn fault(field: impl Into<String>, problem: impl ToString) -> InjectError {
    InjectError { field: field.into(), problem: problem.to_string() }
}

/// A scenario ready to be played.
pub struct Prepared {
    /// The world at t = 0.
    pub world: World,
    /// Its map, as it is served.
    pub map: wire::OccupancyGrid,
    /// What the robot is to do.
    pub order: MissionOrder,
    /// How to plan.
    pub profile: Profile,
    /// Seed of everything random.
    pub seed: u64,
}

/// Checks everything and builds the world. `files` must hold the map's yaml under the scenario's
/// `map.file`, its image under the name the yaml gives (without directories), and every recording.
pub fn prepare(request: &InjectRequest, robot: &str) -> Result<Prepared, InjectError> {
    let scenario: Scenario =
        convert::from_value("scenario", &request.scenario).map_err(|r| refused("scenario", &r))?;
    scenario.check()?;
    let params = check_localizer(&scenario)?;
    let profile = profile(request)?;
    let grid = {
        let text = String::from_utf8_lossy(file(request, "map.file", &scenario.map.file)?);
        let yaml = MapYaml::parse(&text).map_err(|e| fault("map.file", e))?;
        let image = yaml.image.rsplit('/').next().unwrap_or(&yaml.image);
        load_map(&yaml, file(request, "map.file: image", image)?).map_err(|e| fault("map.file", e))?
    };
    let recordings = scenario
        .recorded
        .iter()
        .enumerate()
        .map(|(i, r)| recording(request, i, r))
        .collect::<Result<_, _>>()?;
    let map_message = convert::occupancy_grid_to_wire(&grid);
    let seed = request.seed.unwrap_or(1);
    let world = World::new(&scenario, StaticMap::new(grid), recordings, seed)?;
    let order = order(request, &scenario, &profile, params, map_message.map, robot, seed)?;
    Ok(Prepared { world, map: map_message, order, profile, seed })
}

/// A refusal of the field `field`, which says what is wrong and not which field that is.
fn refused(field: &str, reject: &Reject) -> InjectError {
    fault(field, words::say("refusal", &reject.why))
}

fn profile(request: &InjectRequest) -> Result<Profile, InjectError> {
    let profile: Profile =
        convert::from_value("profile", &request.profile).map_err(|r| refused("profile", &r))?;
    profile.check().map_err(|e| e.below("profile"))?;
    Ok(profile)
}

/// The localiser's parameters as they travel, once they have been read and found sensible.
fn check_localizer(scenario: &Scenario) -> Result<Value, InjectError> {
    let Some(table) = &scenario.localizer else { return Ok(Value::Map(Vec::new())) };
    read_table::<LocalizerParams>(table).map_err(|e| e.below("localizer"))?;
    convert::to_value(table).map_err(|r| refused("localizer", &r))
}

fn file<'a>(request: &'a InjectRequest, field: &str, name: &str) -> Result<&'a [u8], InjectError> {
    let missing = || fault(field, format!("`{name}` is not among the files sent with the scenario"));
    request.files.get(name).map(|bytes| bytes.as_slice()).ok_or_else(missing)
}

fn recording(request: &InjectRequest, index: usize, recorded: &Recorded) -> Result<Recording, InjectError> {
    let field = format!("recorded[{index}].file");
    let text = String::from_utf8_lossy(file(request, &field, &recorded.file)?);
    Recording::parse(&text, recorded.format, recorded.fps)
        .map_err(|e| fault(field, format!("{}: {e}", recorded.file)))
}

/// Ticks between plans. In real time the arbiter plans ten times a second of the wall's clock, if ticks come that
/// often: a robot that thinks every 0.3 s meets people who turn round a moment too late.
fn plan_every(scenario: &Scenario, request: &InjectRequest) -> u32 {
    let wished = scenario.clock.plan_every;
    match request.clock {
        Clock::Lockstep => wished,
        Clock::Realtime => {
            let ticks = (0.1 * request.time_scale / scenario.clock.tick_s).ceil();
            wished.min(ticks as u32).max(1)
        }
    }
}

fn order(
    request: &InjectRequest,
    scenario: &Scenario,
    profile: &Profile,
    localizer: Value,
    map: MapId,
    robot: &str,
    seed: u64,
) -> Result<MissionOrder, InjectError> {
    let sigma = scenario.robot.initial_sigma;
    let mut covariance = vec![0.0; 9];
    for (i, sigma) in sigma.iter().enumerate() {
        covariance[4 * i] = sigma * sigma;
    }
    Ok(MissionOrder {
        robot: robot.to_owned(),
        map,
        initial_pose: convert::pose_to_wire(scenario.robot.start),
        initial_covariance: covariance.into(),
        goal_x: scenario.robot.goal.x,
        goal_y: scenario.robot.goal.y,
        goal_heading: scenario.robot.goal_heading,
        goal_tolerance: scenario.robot.goal_tolerance,
        profile: convert::to_value(profile).map_err(|r| refused("profile", &r))?,
        localizer,
        laser: convert::laser_to_wire(&scenario.laser),
        robot_model: convert::robot_model_to_wire(&scenario.robot.model),
        odometry_noise: convert::noise_to_wire(&scenario.odometry_noise),
        seed,
        clock: request.clock,
        time_scale: if request.clock == Clock::Lockstep { 1.0 } else { request.time_scale },
        tick_s: scenario.clock.tick_s,
        plan_every: plan_every(scenario, request),
        require: REQUIRED.map(String::from).to_vec(),
    })
}
