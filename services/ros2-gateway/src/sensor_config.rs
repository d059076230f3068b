//! What the gateway is told of further sensors: `[[ros2.sensors]]` of its configuration file.

use std::time::Duration;

use curionav_planning::parameters::{FieldError, Range};
use curionav_schemas::keys::check_id;

curionav_planning::parameters! {
    /// What a further sensor is.
    pub enum SensorKind {
        /// A depth camera or a lidar of many layers (`sensor_msgs/PointCloud2`).
        Cloud,
        /// One more scanner (`sensor_msgs/LaserScan`).
        Scan,
        /// What measures one distance by sound or light (`sensor_msgs/Range`).
        Range,
        /// A bumper (`std_msgs/Bool`).
        Bumper,
        /// A costmap of Nav2 (`nav_msgs/OccupancyGrid`), such as its local one: the cells that are occupied.
        Costmap,
    }
}

/// Heights of points, m: above and below these no robot is.
const HEIGHT: Range = Range {
    least: -1.0,
    most: 5.0,
    unit: "m",
    why: "no service robot is higher, and floors lie not so far below",
};

curionav_planning::parameters! {
    /// One further sensor.
    pub struct SensorConfig {
        /// What keys and messages call it.
        pub name: String [name, "give the sensor a name, such as \"camera\""],
        /// What it is.
        pub kind: SensorKind [words],
        /// Where it speaks.
        pub topic: String [name, "give the name of its topic"],
        /// Whether the robot stands while it is silent, as it does without the scanner.
        #[serde(default)]
        pub required: bool,
        /// After how long without news it counts as silent: seconds of a clock that nothing sets. If it is left out:
        /// 0.4 s, 2 s for a costmap, and never for a bumper that is not required:
        /// many speak only when they are touched.
        #[serde(default)]
        pub silence: Option<f64> [0.05, 2.0, "s", "a robot at 1 m/s is two metres on"],
        /// Points lower or higher than these are none, in the frame of the robot; of a cloud alone, which needs it.
        #[serde(default)]
        pub height: Option<[f64; 2]> [in HEIGHT],
        /// How far it sees; of a cloud or costmap alone. If it is left out: 4 m.
        #[serde(default)]
        pub range: Option<f64> [0.1, 50.0, "m", "a robot drives by nothing farther away"],
        /// Direction of the middle of a bumper, seen from the middle of the robot. If it is left out: 0, ahead.
        #[serde(default)]
        pub bearing: Option<f64> [-3.15, 3.15, "rad", "it is half a turn at most, and is probably meant as degrees"],
        /// Angle over which a bumper reaches, seen from there. If it is left out: 1 rad.
        #[serde(default)]
        pub width: Option<f64> [0.1, 6.2, "rad", "there are no smaller ones, and more is all around"],
    } check Self::agrees
}

/// How far a cloud or costmap is taken to see, m: depth cameras err more farther away.
const CLOUD_RANGE: f64 = 4.0;
/// Angle over which a bumper is taken to reach, rad: the front of a round robot.
const BUMPER_WIDTH: f64 = 1.0;
/// Seconds after which a sensor counts as silent.
const SILENCE: f64 = 0.4;
/// The same of a costmap: Nav2 publishes one once or twice per second.
const COSTMAP_SILENCE: f64 = 2.0;

impl SensorConfig {
    fn agrees(&self) -> Result<(), FieldError> {
        check_id(&self.name).map_err(|error| {
            FieldError::new("name", format!("is `{}`", error.name), "use a-z, 0-9, `_` and `-`")
        })?;
        let is_cloud = self.kind == SensorKind::Cloud;
        let is_bumper = self.kind == SensorKind::Bumper;
        let sees_far = is_cloud || self.kind == SensorKind::Costmap;
        let foreign = [
            ("height", self.height.is_some() && !is_cloud, "a cloud"),
            ("range", self.range.is_some() && !sees_far, "a cloud or costmap"),
            ("bearing", self.bearing.is_some() && !is_bumper, "a bumper"),
            ("width", self.width.is_some() && !is_bumper, "a bumper"),
        ];
        if let Some((field, _, of)) = foreign.into_iter().find(|(_, is_foreign, _)| *is_foreign) {
            let problem = format!("is given, and only {of} has it");
            return Err(FieldError::new(field, problem, "leave it out"));
        }
        match self.height {
            None if is_cloud => {
                let mend = "give the lowest and the highest point that the robot could touch, m";
                Err(FieldError::new("height", "is missing", mend))
            }
            Some([low, high]) if low >= high => {
                let problem = format!("is {low} to {high}");
                Err(FieldError::new("height", problem, "give the lower one first"))
            }
            _ => Ok(()),
        }
    }

    /// After how long it counts as silent, if it ever does.
    pub(crate) fn silence(&self) -> Option<Duration> {
        let usual = match self.kind {
            SensorKind::Bumper if !self.required => None,
            SensorKind::Costmap => Some(COSTMAP_SILENCE),
            _ => Some(SILENCE),
        };
        let seconds = self.silence.or(usual);
        seconds.map(Duration::from_secs_f64)
    }

    /// The lowest and the highest point of a cloud that counts, m.
    pub(crate) fn band(&self) -> [f64; 2] {
        self.height.unwrap_or([f64::NEG_INFINITY, f64::INFINITY])
    }

    /// Where Nav2 says what has changed on a costmap between two that are whole.
    pub(crate) fn updates(&self) -> String {
        format!("{}_updates", self.topic)
    }

    /// How far a cloud or costmap sees, m.
    pub(crate) fn reach(&self) -> f64 {
        self.range.unwrap_or(CLOUD_RANGE)
    }

    /// Direction of the middle of a bumper and the angle over which it reaches, rad.
    pub(crate) fn rim(&self) -> (f64, f64) {
        (self.bearing.unwrap_or(0.0), self.width.unwrap_or(BUMPER_WIDTH))
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::parameters::Ranged;

    use super::*;

    fn read(text: &str) -> Result<SensorConfig, String> {
        let config: SensorConfig = toml::from_str(text).map_err(|error| error.message().to_owned())?;
        config.check().map_err(|error| error.to_string())?;
        Ok(config)
    }

    #[test]
    fn a_sensor_that_makes_no_sense_is_named_with_field_and_mend() {
        let camera = "name = \"camera\"\ntopic = \"points\"\nkind = \"cloud\"\n";
        let bumper = "name = \"bumper\"\ntopic = \"bumper\"\nkind = \"bumper\"\n";
        for (text, said) in [
            (camera.to_owned(), "height: is missing; give the lowest"),
            (format!("{camera}height = [1.0, 0.1]"), "height: is 1 to 0.1; give the lower one first"),
            (format!("{camera}height = [0.1, 9.0]"), "height[1]: is 9"),
            (
                format!("{camera}height = [0.1, 1.0]\nwidth = 1.0"),
                "width: is given, and only a bumper has it",
            ),
            (format!("{bumper}range = 1.0"), "range: is given, and only a cloud or costmap has it"),
            (format!("{bumper}bearing = 90.0"), "bearing: is 90"),
            (format!("{bumper}silence = 5.0"), "silence: is 5"),
            (bumper.replace("name = \"bumper\"", "name = \"Front Left\""), "name: is `Front Left`"),
            (bumper.replace("kind = \"bumper\"", "kind = \"sonar\""), "unknown variant `sonar`"),
            (format!("{bumper}colour = 1"), "unknown field `colour`"),
        ] {
            let fault = read(&text).unwrap_err();
            assert!(fault.starts_with(said), "{text}: {fault}");
        }
    }

    #[test]
    fn a_bumper_that_is_not_required_is_never_silent() {
        let read = |more: &str| {
            read(&format!("name = \"b\"\ntopic = \"b\"\nkind = \"bumper\"\n{more}")).unwrap().silence()
        };
        assert_eq!(read(""), None);
        assert_eq!(read("required = true"), Some(Duration::from_secs_f64(0.4)));
        assert_eq!(read("silence = 1.5"), Some(Duration::from_secs_f64(1.5)));
    }
}
