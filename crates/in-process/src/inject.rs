//! From an injected scenario to a world and a mission.

use curionav_crowdsim::scenario::{MapFile, PeopleSource, Recorded, Scenario};
use curionav_crowdsim::world::MOST_PEOPLE;
use curionav_crowdsim::{Maps, Recording, World};
use curionav_localization::LocalizerParams;
use curionav_mission::convert;
use curionav_mission::cores::Cores;
use curionav_mission::fields::Fields;
use curionav_planning::occupancy::{MapYaml, MaskError, OccupancyGrid, StaticMap, load_map};
use curionav_planning::parameters::read_table;
use curionav_planning::profile::Profile;
use curionav_planning::text::loose_text;
use curionav_schemas::limits::MAX_PEOPLE;
use curionav_schemas::{
    self as wire, Clock, InjectRequest, MapId, MissionOrder, Refusal, Reject, Value, keys,
};
use curionav_tracking_people::TrackerParams;

/// What a scenario may hold fits into a message.
const _: () = assert!(MOST_PEOPLE == MAX_PEOPLE);

/// Roles that every run needs.
const REQUIRED: [&str; 3] = ["arbiter", "driver", "localizer"];

/// A scenario ready to be played.
pub struct Prepared {
    /// The world at t = 0.
    pub world: World,
    /// The map that the robot is given, as it is served.
    pub map: wire::OccupancyGrid,
    /// The walls that are there, if they are not those of the map.
    pub truth: Option<wire::OccupancyGrid>,
    /// What the robot is to do.
    pub order: MissionOrder,
    /// How to plan.
    pub profile: Profile,
    /// Seed of everything random.
    pub seed: u64,
}

impl Prepared {
    /// For each cell of `map`, in its order: whether it is free and no landmark is within the laser's range.
    pub fn bare(&self) -> Vec<bool> {
        let map = self.world.map();
        let range = self.world.scenario().laser.range_max;
        let bare = self.map.cells.iter().enumerate().map(|(i, cell)| {
            let centre = map.grid.centre(i % map.grid.width(), i / map.grid.width());
            *cell == 0 && map.to_occupied.at(&map.grid, centre) > range
        });
        bare.collect()
    }
}

/// Checks everything and builds the world. `files` must hold the map's yaml under the scenario's
/// `map.file`, its image under the name the yaml gives (without directories), and every recording. The same holds for
/// the masks of the map and for the true map.
pub fn prepare(request: &InjectRequest, robot: &str, fields: &Fields) -> Result<Prepared, Reject> {
    let scenario: Scenario = convert::read_value(&request.scenario).map_err(|fault| {
        let is_whole = fault.field.is_empty();
        convert::refusal(if is_whole { fault.below("scenario") } else { fault })
    })?;
    let localizer = localizer(&scenario)?;
    let tracker = tracker(&scenario)?;
    let profile: Profile = convert::parameters("profile", &request.profile)?;
    let grid = zoned(request, &scenario.map)?;
    let truth = scenario.world.file.as_ref().map(|name| map_of(request, "world.file", name)).transpose()?;
    let recordings = (scenario.recorded.iter().enumerate())
        .map(|(i, recorded)| recording(request, i, recorded))
        .collect::<Result<_, _>>()?;
    let map = convert::occupancy_grid_to_wire(&grid);
    let seed = request.seed.unwrap_or(1);
    let wire_truth = truth.as_ref().map(convert::occupancy_grid_to_wire);
    let given = (*fields.insert(grid)).clone();
    let maps = match truth {
        Some(truth) => Maps { given, truth: StaticMap::by(&Cores::all(), truth) },
        None => Maps::of(given),
    };
    let world = World::on(&scenario, maps, recordings, seed).map_err(convert::refusal)?;
    let order = order(request, &scenario, &profile, (localizer, tracker), map.map, robot, seed)?;
    Ok(Prepared { world, map, truth: wire_truth, order, profile, seed })
}

/// The map that the robot is given, with the zones of its masks.
fn zoned(request: &InjectRequest, files: &MapFile) -> Result<OccupancyGrid, Reject> {
    let refused = |field: &str, error: MaskError| Refusal::invalid(error).at(field);
    let mut grid = map_of(request, "map.file", &files.file)?;
    if let Some(name) = &files.keepout {
        let mask = map_of(request, "map.keepout", name)?;
        grid = grid.with_keepout(&mask).map_err(|e| refused("map.keepout", e))?;
    }
    if let Some(name) = &files.speed {
        let mask = map_of(request, "map.speed", name)?;
        grid = grid.with_speed_limits(&mask, files.speed_scale()).map_err(|e| refused("map.speed", e))?;
    }
    Ok(grid)
}

/// The map whose description has this name.
fn map_of(request: &InjectRequest, field: &str, name: &str) -> Result<OccupancyGrid, Reject> {
    let invalid = |error: String| Refusal::invalid(error).at(field);
    let text = loose_text(file(request, field, name)?).map_err(|e| invalid(e.to_string()))?;
    let yaml = MapYaml::parse(&text).map_err(|e| invalid(e.to_string()))?;
    let image = yaml.image.rsplit('/').next().unwrap_or(&yaml.image);
    let image = file(request, &format!("{field}: image"), image)?;
    load_map(&yaml, image).map_err(|e| invalid(e.to_string()))
}

/// Roles that must report ready before a run starts.
fn required(scenario: &Scenario) -> Vec<String> {
    let tracker = (scenario.perception.source == PeopleSource::Tracker).then_some(keys::TRACKER);
    REQUIRED.into_iter().chain(tracker).map(String::from).collect()
}

/// The tracker's parameters as they travel, if people are tracked: those of the scenario, and how wide its people are.
fn tracker(scenario: &Scenario) -> Result<Option<Value>, Reject> {
    let mut table = scenario.tracker.clone().unwrap_or_default();
    table.entry("radius").or_insert(scenario.people.radius.into());
    read_table::<TrackerParams>(&table).map_err(|e| convert::refusal(e.below("tracker")))?;
    let tracked = scenario.perception.source == PeopleSource::Tracker;
    tracked.then(|| convert::to_value(&table)).transpose()
}

/// The localiser's parameters as they travel, once they have been read and found sensible.
fn localizer(scenario: &Scenario) -> Result<Value, Reject> {
    let Some(table) = &scenario.localizer else { return Ok(Value::Map(Vec::new())) };
    read_table::<LocalizerParams>(table).map_err(|e| convert::refusal(e.below("localizer")))?;
    convert::to_value(table)
}

fn file<'a>(request: &'a InjectRequest, field: &str, name: &str) -> Result<&'a [u8], Reject> {
    let Some(bytes) = request.files.get(name) else {
        let problem = format!("`{name}` is not among the files sent with the scenario");
        return Err(Refusal::invalid(problem).at(field));
    };
    Ok(bytes.as_slice())
}

fn recording(request: &InjectRequest, index: usize, recorded: &Recorded) -> Result<Recording, Reject> {
    let field = format!("recorded[{index}].file");
    Recording::read(file(request, &field, &recorded.file)?, recorded.format, recorded.fps)
        .map_err(|e| Refusal::invalid(format!("{}: {e}", recorded.file)).at(field))
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
    (localizer, tracker): (Value, Option<Value>),
    map: MapId,
    robot: &str,
    seed: u64,
) -> Result<MissionOrder, Reject> {
    let setup = &scenario.robot;
    let mut covariance = vec![0.0; 9];
    for (i, sigma) in setup.initial_sigma.iter().enumerate() {
        covariance[4 * i] = sigma * sigma;
    }
    Ok(MissionOrder {
        robot: robot.to_owned(),
        map,
        initial_pose: convert::pose_to_wire(setup.start),
        initial_covariance: covariance.into(),
        initial_doubtful: false,
        goal_x: setup.goal.x,
        goal_y: setup.goal.y,
        goal_heading: setup.goal_heading,
        way: None,
        goal_tolerance: setup.goal_tolerance,
        profile: convert::to_value(profile)?,
        localizer,
        tracker,
        laser: convert::laser_to_wire(&scenario.laser),
        robot_model: convert::robot_model_to_wire(&setup.model),
        odometry_noise: convert::noise_to_wire(&scenario.odometry_noise),
        seed,
        clock: request.clock,
        time_scale: if request.clock == Clock::Lockstep { 1.0 } else { request.time_scale },
        tick_s: scenario.clock.tick_s,
        plan_every: plan_every(scenario, request),
        require: required(scenario),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_testing::golden;

    #[test]
    fn a_refusal_names_its_field_once() {
        let scenario = Value::Map(vec![("nme".into(), "a".into())]);
        let request = InjectRequest { scenario, ..golden::inject_request() };
        let reject = prepare(&request, "robot", &Fields::of_maps([])).err().unwrap();
        assert_eq!(reject.field.as_deref(), Some("nme"));
        let scenario = Value::Map(vec![("name".into(), Value::Null)]);
        let request = InjectRequest { scenario, ..golden::inject_request() };
        let reject = prepare(&request, "robot", &Fields::of_maps([])).err().unwrap();
        assert_eq!(reject.field.as_deref(), Some("scenario"));
        assert_eq!(reject.to_string().matches("scenario").count(), 1, "{reject}");
    }
}
