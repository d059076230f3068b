//! What the gateway is told: the table `[ros2]` of its configuration file.

use std::path::{Path, PathBuf};

use anyhow::{Context, anyhow, ensure};
use curionav_localization::LocalizerParams;
use curionav_planning::motion::OdometryNoise;
use curionav_planning::parameters::{FieldError, Range, read_table};
use curionav_planning::profile::Profile;
use curionav_ros2::dialect::{Dialect, RmwZenoh, Ros2Dds};
use curionav_ros2::interface::Distribution;
use curionav_runtime::endpoint::{Purpose, check_endpoint};
use curionav_runtime::robot_limits::RobotLimits;
use curionav_schemas::limits::MAX_SENSORS;
use curionav_tracking_people::TrackerParams;
use serde::{Deserialize, Serialize};

use crate::sensor_config::SensorConfig;
use crate::topics::{NAME, Topics};

/// How ROS 2 is on Zenoh.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum DialectName {
    /// The robot's nodes run with `rmw_zenoh_cpp`.
    RmwZenoh,
    /// They run on DDS, behind `zenoh-bridge-ros2dds`.
    #[serde(rename = "ros2dds")]
    Ros2Dds,
}

curionav_planning::parameters! {
    /// The distribution of ROS 2 that the robot runs.
    pub enum DistributionName {
        /// May 2022.
        Humble,
        /// May 2024.
        Jazzy,
        /// May 2025.
        Kilted,
        /// May 2026.
        Lyrical,
    }
}

curionav_planning::parameters! {
    /// What of Nav2 the gateway takes the place of.
    pub enum Mode {
        /// Of all of it: the gateway is given goals, and curionav localises the robot.
        Navigator,
        /// Of `controller_server` alone: the gateway is given paths, and the robot's own localisation is used.
        Controller,
    }
}

curionav_planning::parameters! {
    /// Who says where people are.
    pub enum PeopleSource {
        /// `curionav tracker`, which finds them in the laser's scans.
        Tracker,
        /// The topic `people`.
        Topic,
    }
}

curionav_planning::parameters! {
    /// Names of frames. What is said in any other frame is used only if transforms lead to one of these.
    pub struct Frames {
        /// Of maps, goals and poses.
        pub map: String [name, NAME] = "map".to_owned(),
        /// Of odometry.
        pub odom: String [name, NAME] = "odom".to_owned(),
        /// Of the robot: x ahead, y to the left, at its centre of rotation.
        pub base: String [name, NAME] = "base_link".to_owned(),
    }
}

curionav_planning::parameters! {
    /// After how long without news the robot is stopped: seconds of a clock that nothing sets.
    pub struct Silence {
        /// Without a command of the driver.
        pub command: f64 [0.05, 0.4, "s", "a robot at 1 m/s is half a metre on"] = 0.25,
        /// Without odometry.
        pub odom: f64 [0.05, 0.4, "s", "a robot at 1 m/s is half a metre on"] = 0.3,
        /// Without a scan that can be used.
        pub scan: f64 [0.05, 0.4, "s", "a robot at 1 m/s is half a metre on"] = 0.4,
    }
}

curionav_planning::parameters! {
    /// What every mission has in common.
    pub struct MissionDefaults {
        /// A planner by the name of a built-in profile, or a profile's file (beside the configuration if relative).
        pub profile: String [name, "name a profile, such as curionav"] = "curionav".to_owned(),
        /// Distance at which the goal counts as reached.
        pub goal_tolerance: f64 [0.05, 5.0, "m", "localisation is not better, and farther away is elsewhere"] = 0.5,
        /// Where the robot must not drive: a mask on the map, a `map_server` YAML file (beside the configuration if
        /// relative).
        pub keepout: Option<PathBuf> = None,
        /// Where the robot is slower: another such file, whose values are those of Nav2's speed filter.
        pub speed: Option<PathBuf> = None,
        /// `base` of Nav2's `CostmapFilterInfo` for that file.
        pub speed_base: f64 [-1e4, 1e4, "%", "no speed is so great a share of another"] = 100.0,
        /// `multiplier` of Nav2's `CostmapFilterInfo` for that file.
        pub speed_multiplier: f64 [-1e4, 1e4, "%", "no speed is so great a share of another"] = -1.0,
        /// Where the robot is when the gateway starts: x, y in metres and heading in radians, in the frame of the map.
        /// Without it, the first `initialpose` says so.
        pub initial_pose: Option<Vec<f64>>
            [in Range::POSITION, Range::POSITION, Range::HEADING; 3.0, 3.0, "x, y, heading"] = None,
        /// Standard deviation of that pose: metres, metres, radians.
        pub initial_sigma: [f64; 3] [0.0, 10.0, "", "a robot that is farther off is lost"] = [0.5, 0.5, 0.262],
        /// Standard deviation of one range of the laser.
        pub range_sigma: f64 [0.0, 1.0, "m", "a worse laser sees nothing"] = 0.03,
        /// Radius of a person.
        pub person_radius: f64 [0.05, 2.0, "m", "thinner bodies are poles, wider ones are groups"] = 0.25,
        /// How far off odometry is.
        pub odometry_noise: OdometryNoise [table] = OdometryNoise::default(),
        /// Parameters of the localiser that differ from its defaults.
        pub localizer: toml::Table = toml::Table::new(),
        /// Parameters of the tracker of people that differ from its defaults.
        pub tracker: toml::Table = toml::Table::new(),
    }
}

curionav_planning::parameters! {
    /// How one robot of ROS 2 is met.
    pub struct Ros2Config {
        /// Where the robot's router listens: its `rmw_zenohd`, or the bridge.
        pub endpoint: String [name, "give tcp/HOST:PORT"] = "tcp/127.0.0.1:7447".to_owned(),
        /// A Zenoh configuration file for the session with that router, to which `endpoint` is added.
        pub zenoh_config: Option<PathBuf> = None,
        /// What of Nav2 the gateway takes the place of.
        pub mode: Mode [words] = Mode::Navigator,
        /// How ROS 2 is on Zenoh there: `rmw_zenoh` or `ros2dds`.
        pub dialect: DialectName = DialectName::RmwZenoh,
        /// The distribution that the robot runs.
        pub distribution: DistributionName [words] = DistributionName::Kilted,
        /// The robot's `ROS_DOMAIN_ID`.
        pub domain: u32 [0.0, 232.0, "", "ROS has no others"] = 0,
        /// Namespace of the robot's topics, such as `/r1`; empty if they have none.
        pub namespace: String = String::new(),
        /// Name of the gateway's node.
        pub node: String [name, NAME] = "curionav_gateway".to_owned(),
        /// Whether velocities carry a stamp (`TwistStamped`). Without it as the distribution has it: from kilted on.
        pub stamped: Option<bool> = None,
        /// Whether the robot's time is that of a simulation, told on `clock`.
        pub use_sim_time: bool = false,
        /// Who says where people are.
        pub people: PeopleSource [words] = PeopleSource::Tracker,
        /// Whether the transform from map to odometry is published; no other node may publish it then.
        pub publish_tf: bool = false,
        /// Names of topics.
        pub topics: Topics [table] = Topics::default(),
        /// Names of frames.
        pub frames: Frames [table] = Frames::default(),
        /// When the robot is stopped for want of news.
        pub silence: Silence [table] = Silence::default(),
        /// What sees besides the scanner.
        pub sensors: Vec<SensorConfig> [table; 0.0, MAX_SENSORS as f64, "services keep no more"] = Vec::new(),
        /// What every mission has in common.
        pub mission: MissionDefaults [table] = MissionDefaults::default(),
    } check Self::names_are_of_ros
}

impl From<DistributionName> for Distribution {
    fn from(name: DistributionName) -> Self {
        match name {
            DistributionName::Humble => Self::Humble,
            DistributionName::Jazzy => Self::Jazzy,
            DistributionName::Kilted => Self::Kilted,
            DistributionName::Lyrical => Self::Lyrical,
        }
    }
}

/// Whether a name can be a part of a topic or node: letters, digits and underscores, no digit first.
fn is_name(part: &str) -> bool {
    part.len() <= 255
        && part.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')
        && !part.starts_with(|c: char| c.is_ascii_digit())
        && !part.is_empty()
}

impl Ros2Config {
    /// What the table `[ros2]` of a configuration says; files that it names lie beside `directory` if they are
    /// relative.
    ///
    /// # Errors
    /// If there is none, or a field of it is wrong.
    pub fn read(table: Option<&toml::Table>, directory: &Path) -> anyhow::Result<Self> {
        let table = table.ok_or_else(|| {
            anyhow!(
                "ros2: is missing; give a table [ros2] in the configuration file, as deploy/ros2.toml shows"
            )
        })?;
        let mut config: Self = read_table(table).map_err(|fault| anyhow!("{}", fault.below("ros2")))?;
        config.zenoh_config = config.zenoh_config.map(|file| directory.join(file));
        if Path::new(&config.mission.profile).extension().is_some() {
            let file = directory.join(&config.mission.profile);
            config.mission.profile = file.to_string_lossy().into_owned();
        }
        let mission = &mut config.mission;
        for mask in [&mut mission.keepout, &mut mission.speed].into_iter().flatten() {
            *mask = directory.join(&*mask);
        }
        Ok(config)
    }

    /// Whether only Nav2's controller is replaced.
    pub fn is_controller(&self) -> bool {
        self.mode == Mode::Controller
    }

    /// The topic of what is driven.
    pub fn plan(&self) -> &str {
        if self.is_controller() { &self.topics.local_plan } else { &self.topics.plan }
    }

    /// No name may leave its place in a key, and the robot's router must be somewhere.
    fn names_are_of_ros(&self) -> Result<(), FieldError> {
        check_endpoint(&self.endpoint, Purpose::Connect).map_err(|error| error.at("endpoint"))?;
        if self.is_controller() && self.distribution() == Distribution::Humble {
            let mend = "the mode `controller` needs jazzy or later";
            return Err(FieldError::new("mode", "is `controller`, and the distribution is humble", mend));
        }
        if self.is_controller() && self.publish_tf {
            let problem = "is true, and in the mode `controller` Nav2 publishes that transform";
            return Err(FieldError::new("publish_tf", problem, "leave it out"));
        }
        let topics = self.topics.named();
        let namespace = self.namespace.trim_matches('/');
        let whole = [("namespace".to_owned(), namespace), ("node".to_owned(), self.node.as_str())];
        let whole = whole.into_iter().filter(|(_, name)| !name.is_empty());
        let sensors = self.sensors.iter().enumerate();
        let sensors = sensors.map(|(at, sensor)| (format!("sensors[{at}].topic"), sensor.topic.as_str()));
        let topics = topics.into_iter().map(|(field, name)| (format!("topics.{field}"), name));
        for (field, name) in topics.chain(whole).chain(sensors) {
            let name = name.strip_prefix('/').unwrap_or(name);
            if !name.split('/').all(is_name) {
                let problem = format!("is `{name}`");
                return Err(FieldError::new(field, problem, "use letters, digits, `_` and `/` only"));
            }
        }
        for (at, sensor) in self.sensors.iter().enumerate() {
            if self.sensors[..at].iter().any(|before| before.name == sensor.name) {
                let problem = format!("is `{}`, as of another sensor", sensor.name);
                return Err(FieldError::new(format!("sensors[{at}].name"), problem, "give each its own"));
            }
        }
        Ok(())
    }

    /// A topic's name with its outer slash.
    pub fn resolve(&self, topic: &str) -> String {
        match (topic.strip_prefix('/'), self.namespace.trim_matches('/')) {
            (Some(absolute), _) => format!("/{absolute}"),
            (None, "") => format!("/{topic}"),
            (None, namespace) => format!("/{namespace}/{topic}"),
        }
    }

    /// The robot's distribution.
    pub fn distribution(&self) -> Distribution {
        self.distribution.into()
    }

    /// The dialect that its nodes speak.
    pub fn dialect(&self) -> Box<dyn Dialect> {
        match self.dialect {
            DialectName::RmwZenoh => {
                Box::new(RmwZenoh { domain: self.domain, distribution: self.distribution() })
            }
            DialectName::Ros2Dds => Box::new(Ros2Dds),
        }
    }

    /// Whether velocities carry a stamp.
    pub fn is_stamped(&self) -> bool {
        self.stamped.unwrap_or_else(|| self.distribution().stamps_velocities())
    }

    /// The planner of every mission.
    ///
    /// # Errors
    /// If there is none of that name, or its file is wrong.
    pub fn profile(&self) -> anyhow::Result<Profile> {
        let name = &self.mission.profile;
        if let Some(profile) = Profile::builtin(name) {
            return Ok(profile);
        }
        let known: Vec<&str> = Profile::names().collect();
        let is_file = Path::new(name).extension().is_some_and(|e| e == "toml");
        ensure!(
            is_file,
            "ros2.mission.profile: unknown planner `{name}`; use one of {}, or a .toml file",
            known.join(", ")
        );
        let text = std::fs::read_to_string(name).with_context(|| format!("ros2.mission.profile: {name}"))?;
        Profile::from_toml(&text).with_context(|| format!("ros2.mission.profile: {name}"))
    }

    /// Checks what belongs to other crates: parameters of the localiser and of the tracker, and that the silence is
    /// longer than the time between two messages of odometry.
    ///
    /// # Errors
    /// Names the field.
    pub fn check_against(&self, limits: &RobotLimits) -> anyhow::Result<()> {
        read_table::<LocalizerParams>(&self.mission.localizer)
            .map_err(|fault| anyhow!("{}", fault.below("ros2.mission.localizer")))?;
        read_table::<TrackerParams>(&self.tracker())
            .map_err(|fault| anyhow!("{}", fault.below("ros2.mission.tracker")))?;
        for (field, seconds) in [("command", self.silence.command), ("odom", self.silence.odom)] {
            ensure!(
                seconds > limits.tick_s,
                "ros2.silence.{field}: is {seconds} s, and odometry comes every {} s (limits.tick_s); give more",
                limits.tick_s
            );
        }
        Ok(())
    }

    /// The tracker's parameters as a mission has them: people are as wide as is said here.
    pub fn tracker(&self) -> toml::Table {
        let mut table = self.mission.tracker.clone();
        table.entry("radius").or_insert(self.mission.person_radius.into());
        table
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::parameters::Ranged;

    use super::*;

    fn read(text: &str) -> anyhow::Result<Ros2Config> {
        let table: toml::Table = text.parse().unwrap();
        Ros2Config::read(table.get("ros2").and_then(toml::Value::as_table), Path::new("/etc/curionav"))
    }

    #[test]
    fn the_file_for_a_controller_is_read_and_what_it_must_not_have_is_refused() {
        let text = include_str!("../../../deploy/ros2/controller.toml");
        let config = read(text).unwrap();
        assert!(config.is_controller() && config.sensors.len() == 1 && config.plan() == "local_plan");
        let humble = text.replace("kilted", "humble");
        let said = read(&humble).unwrap_err().to_string();
        assert!(said.contains("mode: is `controller`, and the distribution is humble"), "{said}");
        let twice = text.replace("mode = \"controller\"", "mode = \"controller\"\npublish_tf = true");
        assert!(read(&twice).unwrap_err().to_string().contains("publish_tf: is true"));
    }

    #[test]
    fn the_documented_file_says_the_defaults() {
        let text = include_str!("../../../deploy/ros2.toml");
        assert_eq!(read(text).unwrap(), Ros2Config::default());
        // Every field stands in it, also one that has no default and is commented out.
        let fields =
            |of: &[curionav_planning::parameters::Field]| of.iter().map(|f| f.name).collect::<Vec<_>>();
        for field in [
            Ros2Config::FIELDS,
            Topics::FIELDS,
            Frames::FIELDS,
            Silence::FIELDS,
            SensorConfig::FIELDS,
            MissionDefaults::FIELDS,
        ]
        .map(fields)
        .concat()
        {
            let stands = |line: &str| {
                let line = line.trim_start_matches("# ").trim_end_matches(']');
                line.starts_with(&format!("{field} = ")) || line.ends_with(&format!(".{field}"))
            };
            assert!(text.lines().any(stands), "{field}");
        }
    }

    #[test]
    fn a_wrong_field_is_named_with_its_mend() {
        for (text, said) in [
            ("[ros2]\ndomain = 233", "ros2.domain: is 233"),
            ("[ros2]\ndomian = 1", "domian"),
            ("[ros2.topics]\nscan = \"a/*/b\"", "ros2.topics.scan: is `a/*/b`"),
            ("[ros2.topics]\nscan = \"\"", "ros2.topics.scan: is empty"),
            ("[ros2]\nnamespace = \"/r 1\"", "ros2.namespace: is `r 1`"),
            ("[ros2]\ndistribution = \"rolling\"", "rolling"),
            ("[ros2.silence]\nscan = 0.5", "ros2.silence.scan: is 0.5"),
            (
                "[[ros2.sensors]]\nname = \"a\"\nkind = \"range\"\ntopic = \"a*\"",
                "ros2.sensors[0].topic: is `a*`",
            ),
            (
                "[[ros2.sensors]]\nname = \"a\"\nkind = \"range\"\ntopic = \"a\"\n\
                 [[ros2.sensors]]\nname = \"a\"\nkind = \"range\"\ntopic = \"b\"",
                "ros2.sensors[1].name: is `a`",
            ),
            (
                "[[ros2.sensors]]\nname = \"a\"\nkind = \"cloud\"\ntopic = \"a\"",
                "ros2.sensors[0].height: is missing",
            ),
            ("[ros2.mission]\ninitial_pose = [1.0]", "ros2.mission.initial_pose: has 1 entries"),
            ("robot = \"r1\"", "ros2: is missing; give a table [ros2]"),
        ] {
            let error = read(text).unwrap_err().to_string();
            assert!(error.contains(said), "{text}: {error}");
        }
    }

    #[test]
    fn a_relative_topic_lies_in_the_namespace() {
        let config = Ros2Config { namespace: "/r1/".into(), ..Ros2Config::default() };
        assert_eq!(config.resolve("scan"), "/r1/scan");
        assert_eq!(config.resolve("/diagnostics"), "/diagnostics");
        assert_eq!(Ros2Config::default().resolve("curionav/crowd"), "/curionav/crowd");
        assert!(config.is_stamped() && !Ros2Config { stamped: Some(false), ..config }.is_stamped());
    }

    #[test]
    fn parameters_of_others_are_checked_before_a_robot_moves() {
        let limits: RobotLimits = toml::from_str(
            "v_max = 1.0\na_max = 0.5\nomega_max = 1.0\nalpha_max = 1.0\nradius = 0.3\ntick_s = 0.1",
        )
        .unwrap();
        let said = |text: &str| read(text).unwrap().check_against(&limits).map_err(|e| e.to_string());
        assert_eq!(said("[ros2]"), Ok(()));
        let wrong = said("[ros2.mission.localizer]\nbeams = 0").unwrap_err();
        assert!(wrong.starts_with("ros2.mission.localizer.beams: is 0"), "{wrong}");
        let wrong = said("[ros2.silence]\nodom = 0.1").unwrap_err();
        assert!(wrong.starts_with("ros2.silence.odom: is 0.1 s, and odometry comes every 0.1 s"), "{wrong}");
        assert!(read("[ros2.mission]\nprofile = \"none\"").unwrap().profile().is_err());
    }
}
