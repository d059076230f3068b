//! The scenario file: everything that defines a run besides the planner's profile and the seed.
//!
//! Written as TOML by people, carried as a CBOR map between services; both go through the same serde
//! types. Unknown fields are errors everywhere, so that a misspelt one is never silently ignored.

mod arrays;
mod check;
mod crowd;
mod people;
mod reference;
mod validate;
mod world_setup;

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::motion::{OdometryNoise, RobotModel};
use curionav_planning::occupancy::SpeedScale;
use curionav_planning::parameters::{FieldError, Range, read};
use curionav_planning::sensor::LaserModel;

pub use check::NarrowPlace;
pub(crate) use check::{connected, reachable};
pub use crowd::{Behaviour, Crowd, Region, contains};
pub use people::{
    Motion, PeopleFrame, PeopleKind, PeopleParams, PeopleShape, PeopleSource, PerceivedPeople, Perception,
    Recorded, RecordingFormat, WalkMode, Walker,
};
pub use world_setup::{LaserFaults, WorldEvent, WorldObject, WorldSetup};

curionav_planning::parameters! {
    /// One scenario. Positions are in the map frame, metres; headings in radians.
    pub struct Scenario {
        /// Short name, unique among the scenarios compared: it labels results.
        pub name: String,
        /// What the scenario shows, for people; may be left out.
        #[serde(default, skip_serializing_if = "String::is_empty")]
        pub description: String,
        /// The static map.
        pub map: MapFile [table],
        /// The robot, where it starts and where it shall go.
        pub robot: RobotSetup [table],
        /// The robot's laser, in the simulator as in the localiser and in CPC.
        #[serde(default)]
        pub laser: LaserModel [table],
        /// How the laser fails, in the simulator alone.
        #[serde(default, skip_serializing_if = "LaserFaults::is_none")]
        pub laser_faults: LaserFaults [table],
        /// What really is, where the map says otherwise, and what happens.
        #[serde(default, skip_serializing_if = "WorldSetup::is_as_mapped")]
        pub world: WorldSetup [table],
        /// Noise of the robot's odometry, in the simulator as in the localiser and in CPC (D6).
        #[serde(default)]
        pub odometry_noise: OdometryNoise [table],
        /// Which people the planner is told about, and how they are known.
        #[serde(default)]
        pub perception: Perception [table],
        /// Tick, planning period and time limit.
        #[serde(default)]
        pub clock: Clock [table],
        /// What all people have in common.
        #[serde(default)]
        pub people: PeopleParams [table],
        /// People with routes.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub walkers: Vec<Walker> [table; 0.0, 1000.0, "twenty times the densest published scenario"],
        /// People whom the run's seed draws.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub crowds: Vec<Crowd> [table; 0.0, 64.0, "each is a kind of people"],
        /// Recorded pedestrians.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        pub recorded: Vec<Recorded> [table; 0.0, 16.0, "each is a file that travels with the scenario"],
        /// The planner to use unless the command line names another.
        #[serde(default)]
        pub planner: PlannerChoice [table],
        /// Parameters of the localiser that differ from its defaults; checked by the localiser.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub localizer: Option<toml::Table>,
        /// Parameters of the tracker of people that differ from its defaults; checked by the tracker. Its people are as
        /// wide as those of the scenario.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub tracker: Option<toml::Table>,
        /// Parameters of the planner profile that differ from it; checked by the planner.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub profile: Option<toml::Table>,
    } check Self::is_consistent
}

curionav_planning::parameters! {
    /// Where the static map is.
    pub struct MapFile {
        /// A `map_server` YAML file: a path relative to the scenario file, or `dataset:NAME/FILE` for a file of a
        /// dataset.
        pub file: String [name, "name a map_server YAML file"],
        /// Where the robot must not drive: another `map_server` YAML file, named in the same way, whose occupied cells
        /// are marked. It has its own origin and resolution. A cell of the map is marked if its centre lies in a marked
        /// one of this file, or the other way round. Beams and people pass there, and the robot's body stays out.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub keepout: Option<String>,
        /// Where the robot is slower: another such file. A cell of the value v allows `speed_base + speed_multiplier *
        /// v` per cent of the robot's greatest speed, 1 to 100. At 0, and where it is unknown, the robot is as fast as
        /// it can be. The values are those of Nav2's speed filter: give the file the `mode` `scale` or `raw`.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub speed: Option<String>,
        /// `base` of Nav2's `CostmapFilterInfo`. Default: 100.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub speed_base: Option<f64> [-1e4, 1e4, "%", "no speed is so great a share of another"],
        /// `multiplier` of Nav2's `CostmapFilterInfo`, which is meant to be per cent (type 1). Default: -1.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub speed_multiplier: Option<f64> [-1e4, 1e4, "%", "no speed is so great a share of another"],
    } check Self::scales_a_mask
}

curionav_planning::parameters! {
    /// The robot's task and body.
    pub struct RobotSetup {
        /// Nominal start `[x, y, heading]`: what the localiser is told.
        #[serde(with = "arrays::pose")]
        pub start: Pose2 [in Range::POSITION, Range::POSITION, Range::HEADING],
        /// Goal `[x, y]`.
        #[serde(with = "arrays::point")]
        pub goal: Point2 [in Range::POSITION],
        /// Heading wanted at the goal; none means any. A wish to the planner: arrivals are judged by position.
        #[serde(default, skip_serializing_if = "Option::is_none")]
        pub goal_heading: Option<f64> [in Range::HEADING],
        /// Distance between true position and goal within which an arrival counts (D13, A36), metres.
        #[serde(default = "default_goal_tolerance")]
        pub goal_tolerance: f64 [in Range::GOAL_TOLERANCE],
        /// Standard deviations (m, m, rad) the localiser starts from. Default: those of `amcl`, 0.5 m and
        /// pi/12 (trace 0.5685).
        #[serde(default = "default_initial_sigma", deserialize_with = "arrays::fixed")]
        pub initial_sigma: [f64; 3] [0.0, 10.0, "m or rad", "a filter spread wider has nothing to start from"],
        /// Standard deviation of the true start around the nominal one, as a fraction of `initial_sigma`,
        /// cut at two standard deviations (D8).
        #[serde(default = "default_start_noise")]
        pub start_noise: f64 [0.0, 2.0, "times initial_sigma", "more than that the localiser is not told the truth"],
        /// Outline and limits of the base.
        #[serde(default)]
        pub model: RobotModel [table],
    }
}

fn default_goal_tolerance() -> f64 {
    0.5
}

fn default_initial_sigma() -> [f64; 3] {
    [0.5, 0.5, std::f64::consts::PI / 12.0]
}

fn default_start_noise() -> f64 {
    0.5
}

curionav_planning::parameters! {
    /// Simulated time.
    #[derive(Copy)]
    pub struct Clock {
        /// Length of a simulation tick, seconds. Default 0.1, as in Stage.
        pub tick_s: f64 [
            0.01, 1.0, "s", "no planar laser scans more often, and in a longer tick people pass through each other"
        ] = 0.1,
        /// Ticks between two planning cycles: 3 gives the paper's 0.3 s, 1 plans at 10 Hz. In real time this is
        /// the most; planning is then at 10 Hz if ticks are that frequent.
        pub plan_every: u32
            [1.0, 1000.0, "ticks", "there is no planning between ticks, and who plans more rarely does not plan"] = 3,
        /// Simulated seconds after which the run ends as a timeout (A37).
        pub time_limit_s: f64 [0.01, 864_000.0, "s", "a day of ticks of 0.1 s is the longest run"] = 120.0,
    } check Self::has_ticks
}

curionav_planning::parameters! {
    /// The planner a scenario asks for.
    pub struct PlannerChoice {
        /// Name of a planner profile.
        pub profile: String [name, "name a planner profile"] = "curionav".to_owned(),
    }
}

impl MapFile {
    /// The map of this file, without masks.
    pub fn plain(file: String) -> Self {
        Self { file, keepout: None, speed: None, speed_base: None, speed_multiplier: None }
    }

    /// What the values of the speed mask mean.
    pub fn speed_scale(&self) -> SpeedScale {
        let SpeedScale { base, multiplier } = SpeedScale::default();
        let base = self.speed_base.unwrap_or(base);
        SpeedScale { base, multiplier: self.speed_multiplier.unwrap_or(multiplier) }
    }
}

impl Scenario {
    /// Longest scenario file read, bytes: a thousand walkers with long routes need a tenth of it.
    pub const MAX_TEXT_BYTES: usize = 4 << 20;

    /// Reads and validates a scenario file. Errors name line and field.
    pub fn from_toml(text: &str) -> Result<Self, FieldError> {
        if text.len() > Self::MAX_TEXT_BYTES {
            return Err(FieldError::new(
                "",
                format!("the file has {} bytes, more than {}", text.len(), Self::MAX_TEXT_BYTES),
                "describe fewer walkers",
            ));
        }
        read(text)
    }

    /// The scenario as a file that [`Self::from_toml`] reads back to the same value.
    pub fn to_toml(&self) -> Result<String, toml::ser::Error> {
        toml::to_string(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const FULL: &str = r#"
name = "full"
description = "every field"
[map]
file = "maps/hall.yaml"
keepout = "masks/keepout.yaml"
speed = "masks/speed.yaml"
speed_base = 0.0
speed_multiplier = 0.5
[robot]
start = [1.0, 2, 0.5]
goal = [8.0, 3.0]
goal_heading = 0.0
goal_tolerance = 0.4
initial_sigma = [0.5, 0.5, 0.2618]
start_noise = 0.5
[robot.model]
v_max = 0.8
footprint = { shape = "disc", radius = 0.25 }
[laser]
range_max = 6.0
robot_from_laser = { x = 0.1, y = 0.0, heading = 0.0 }
[laser_faults]
silent_share = 0.1
noise_m = 0.02
moved = [0.1, 0.0, 0.02]
late_s = 0.2
[world]
file = "maps/truth.yaml"
openings = [{ corners = [[2.0, 0.0], [3.0, 0.0], [3.0, 1.0]] }]
[[world.objects]]
at = [4.0, 2.0, 0.3]
size = [2.0, 0.4]
from_s = 3.0
until_s = 40.0
low = true
[[world.objects]]
at = [4.0, 5.0, 0.0]
radius = 0.2
route = [[6.0, 5.0]]
speed = 0.7
[[world.objects]]
at = [7.0, 5.0, 0.0]
corners = [[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]]
glass = 0.8
[[world.events]]
at_s = 10.0
laser = { silent_share = 1.0 }
[[world.events]]
at_s = 12.0
carried_to = [6.0, 1.0, 3.0]
laser = {}
[odometry_noise]
position_per_metre = 0.002
[perception]
people = "working-zone"
frame = "robot"
source = "tracker"
[clock]
plan_every = 1
[people]
radius = 0.3
shape = "legs"
kind = "live"
live_patience_s = 4.0
motion = "hrvo"
[people.hrvo]
max_neighbors = 8
max_accel = 1.5
[[walkers]]
route = [[1.0, 1.0], [4.0, 1.0]]
speed = 0.6
mode = "back-and-forth"
start_offset = 2.0
pause_s = 1.5
[[walkers]]
route = [[6.0, 6.0]]
mode = "stand"
[[crowds]]
count = 12
behaviour = "stand"
regions = [{ corners = [[0.0, 0.0], [4.0, 0.0], [4.0, 3.0]] }]
group = [2, 4]
[[crowds]]
count = 3
places = 4
speed = [0.5, 0.9]
[[recorded]]
file = "zara01/obsmat.txt"
format = "obsmat"
fps = 25.0
start_s = 12.0
start_until_s = 40.0
pose = [3.0, 4.0, 1.57]
ids = [3, 5]
loop = true
[planner]
profile = "risk-rrt"
[localizer]
particles_max = 3000
[tracker]
forget_sigma = 1.5
[profile]
weights = { cpc = 2.0 }
"#;

    #[test]
    fn a_scenario_survives_writing_and_reading() {
        let scenario = Scenario::from_toml(FULL).unwrap();
        assert_eq!(scenario.robot.model.v_max, 0.8);
        assert_eq!(scenario.robot.model.a_max, RobotModel::default().a_max);
        assert_eq!(scenario.walkers[1].mode, WalkMode::Stand);
        assert!(scenario.recorded[0].r#loop);
        assert_eq!((scenario.crowds[0].behaviour, scenario.crowds[0].group), (Behaviour::Stand, [2, 4]));
        assert_eq!((scenario.crowds[1].places, scenario.people_drawn()), (4, 15));
        assert_eq!((scenario.people.motion, scenario.people.hrvo.max_neighbors), (Motion::Hrvo, 8));
        assert_eq!(scenario.people.hrvo.max_speed_factor, 1.3);
        assert_eq!(scenario.people.shape, PeopleShape::Legs);
        assert_eq!(scenario.perception.source, PeopleSource::Tracker);
        assert_eq!((scenario.people.kind, scenario.people.live_patience_s), (PeopleKind::Live, 4.0));
        let back = Scenario::from_toml(&scenario.to_toml().unwrap()).unwrap();
        assert_eq!(back, scenario);
        let mut bytes = Vec::new();
        ciborium::into_writer(&scenario, &mut bytes).unwrap();
        assert_eq!(ciborium::from_reader::<Scenario, _>(&bytes[..]).unwrap(), scenario);
        // and through a serde source that is not text
        assert_eq!(toml::Table::try_from(&scenario).unwrap().try_into::<Scenario>().unwrap(), scenario);
    }

    #[test]
    fn a_short_file_gets_every_default() {
        let text =
            "name = \"s\"\nmap = { file = \"m.yaml\" }\nrobot = { start = [0, 0, 0], goal = [1, 0] }\n";
        let s = Scenario::from_toml(text).unwrap();
        assert_eq!((s.robot.goal_tolerance, s.robot.start_noise), (0.5, 0.5));
        assert_eq!((s.clock.tick_s, s.clock.plan_every, s.clock.time_limit_s), (0.1, 3, 120.0));
        assert_eq!((s.people, s.perception.people), (PeopleParams::default(), PerceivedPeople::All));
        assert_eq!(s.planner.profile, "curionav");
        let trace: f64 = s.robot.initial_sigma.iter().map(|sigma| sigma * sigma).sum();
        assert!((trace - 0.5685).abs() < 1e-4); // 0.25 + 0.25 + (pi/12)^2
    }

    /// Replaces `from` by `to` in the full scenario: the refused field must be `field`, on the line of `to`.
    fn assert_refused(from: &str, to: &str, field: &str) {
        let text = FULL.replacen(from, to, 1);
        let line = text.lines().position(|l| l.contains(to)).map(|i| i + 1);
        let error = Scenario::from_toml(&text).unwrap_err();
        assert_eq!((error.line, error.field.as_str()), (line, field), "{error}");
    }

    #[test]
    fn a_misspelt_field_is_refused_with_its_line_and_name() {
        assert_refused("plan_every", "plan_evry", "clock.plan_evry");
        assert_refused("start_offset", "strat_offset", "walkers[0].strat_offset");
        assert_refused("range_max = 6.0", "range_max = \"far\"", "laser.range_max");
        assert_refused("start = [1.0, 2, 0.5]", "start = [1.0, 2]", "robot.start");
        assert_refused("goal = [8.0, 3.0]", "goal = [8.0, 3.0, 1.57]", "robot.goal");
        assert_refused(
            "initial_sigma = [0.5, 0.5, 0.2618]",
            "initial_sigma = [0.5, 0.5, 0.2618, 1]",
            "robot.initial_sigma",
        );
        assert_refused("max_accel", "max_acel", "people.hrvo.max_acel");
        assert_refused("motion = \"hrvo\"", "motion = \"orca\"", "people.motion");
    }

    #[test]
    fn a_missing_field_is_named_with_its_table() {
        for (line, field) in [
            ("file = \"maps/hall.yaml\"", "map.file"),
            ("goal = [8.0, 3.0]", "robot.goal"),
            ("route = [[6.0, 6.0]]", "walkers[1].route"),
            ("fps = 25.0", "recorded[0].fps"),
            ("count = 12", "crowds[0].count"),
        ] {
            let error = Scenario::from_toml(&FULL.replace(line, "")).unwrap_err();
            assert_eq!(error.field, field, "{error}");
        }
    }

    #[test]
    fn a_bad_value_is_refused_with_its_line_and_name() {
        assert_refused("speed = 0.6", "speed = -0.6", "walkers[0].speed");
        assert_refused("[4.0, 1.0]]", "[nan, 1.0]]", "walkers[0].route[1][0]");
        assert_refused("goal = [8.0, 3.0]", "goal = [inf, 3.0]", "robot.goal[0]");
        assert_refused("v_max = 0.8", "v_max = 0", "robot.model.v_max");
        assert_refused("speed_base = 0.0", "speed_base = nan", "map.speed_base");
        assert_refused("fps = 25.0", "fps = 0", "recorded[0].fps");
        assert_refused("start_until_s = 40.0", "start_until_s = 4.0", "recorded[0].start_until_s");
        assert_refused("plan_every = 1", "plan_every = 0", "clock.plan_every");
        assert_refused("radius = 0.25", "radius = 0.0", "robot.model.footprint.radius");
        assert_refused("name = \"full\"", "name = \"a/b\"", "name");
        assert_refused("group = [2, 4]", "group = [4, 2]", "crowds[0].group");
        assert_refused("speed = [0.5, 0.9]", "speed = [0.5]", "crowds[1].speed");
        assert_refused("[4.0, 3.0]] }]", "[4.0, nan]] }]", "crowds[0].regions[0].corners[2][1]");
        let many = Scenario::from_toml(&FULL.replace("count = 3", "count = 999")).unwrap_err();
        assert_eq!(many.field, "crowds", "{many}");
        assert_refused("live_patience_s = 4.0", "live_patience_s = 0", "people.live_patience_s");
        assert_refused("max_neighbors = 8", "max_neighbors = 0", "people.hrvo.max_neighbors");
        assert_refused("max_accel = 1.5", "max_accel = -1", "people.hrvo.max_accel");
    }
}
