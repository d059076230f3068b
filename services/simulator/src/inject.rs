//! From an injected scenario to a world and a mission.

use curionav_crowdsim::scenario::{Recorded, Scenario};
use curionav_crowdsim::{Recording, ScenarioError, World};
use curionav_localization::LocalizerParams;
use curionav_planning::occupancy::{MapYaml, StaticMap, load_map};
use curionav_planning::profile::Profile;
use curionav_runtime::convert;
use curionav_schemas::{self as wire, Clock, InjectRequest, MapId, Mission, MissionState, Reject, Value};

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
        Self::invalid(error.field, error.problem)
    }
}

impl From<ScenarioError> for InjectError {
    fn from(error: ScenarioError) -> Self {
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
    pub mission: Mission,
    /// How to plan.
    pub profile: Profile,
    /// Seed of everything random.
    pub seed: u64,
}

/// Checks everything and builds the world. `files` must hold the map's yaml under the scenario's
/// `map.file`, its image under the name the yaml gives (without directories), and every recording.
pub fn prepare(request: &InjectRequest, robot: &str) -> Result<Prepared, InjectError> {
    let scenario: Scenario =
        convert::from_value("scenario", &request.scenario).map_err(|r| fault("scenario", r.reason))?;
    scenario.validate()?;
    let params = check_localizer(&scenario)?;
    let profile = profile(&scenario, request.profile.as_deref())?;
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
    let mission = mission(request, &scenario, &profile, params, map_message.map, robot, seed)?;
    Ok(Prepared { world, map: map_message, mission, profile, seed })
}

fn profile(scenario: &Scenario, wanted: Option<&str>) -> Result<Profile, InjectError> {
    let name = wanted.unwrap_or(&scenario.planner.profile);
    let Some(profile) = Profile::builtin(name) else {
        let known: Vec<&str> = Profile::names().collect();
        return Err(fault(
            "planner.profile",
            format!("`{name}` is not a built-in profile; known: {}", known.join(", ")),
        ));
    };
    match &scenario.profile {
        Some(overrides) => profile.with_overrides(overrides).map_err(|e| {
            let field = e.field.as_deref().map_or("profile".to_owned(), |f| format!("profile.{f}"));
            fault(field, e.message)
        }),
        None => Ok(profile),
    }
}

/// The localiser's parameters as they travel, once they have been read and found sensible.
fn check_localizer(scenario: &Scenario) -> Result<Value, InjectError> {
    let Some(table) = &scenario.localizer else { return Ok(Value::Map(Vec::new())) };
    let value = convert::to_value(table).map_err(|e| fault("localizer", e))?;
    let params: LocalizerParams =
        convert::from_value("localizer", &value).map_err(|r| fault("localizer", r.reason))?;
    params.check().map_err(|e| fault("localizer", e))?;
    Ok(value)
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

fn mission(
    request: &InjectRequest,
    scenario: &Scenario,
    profile: &Profile,
    localizer: Value,
    map: MapId,
    robot: &str,
    seed: u64,
) -> Result<Mission, InjectError> {
    let sigma = scenario.robot.initial_sigma;
    let mut covariance = vec![0.0; 9];
    for (i, sigma) in sigma.iter().enumerate() {
        covariance[4 * i] = sigma * sigma;
    }
    Ok(Mission {
        run: 0,
        revision: 0,
        robot: robot.to_owned(),
        map,
        initial_pose: convert::pose_to_wire(scenario.robot.start),
        initial_covariance: covariance.into(),
        goal_x: scenario.robot.goal.x,
        goal_y: scenario.robot.goal.y,
        goal_heading: scenario.robot.goal_heading,
        goal_tolerance: scenario.robot.goal_tolerance,
        profile: convert::to_value(profile).map_err(|e| fault("profile", e))?,
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
        ready: Vec::new(),
        state: MissionState::Preparing,
        has_run: false,
        note: String::new(),
    })
}
