//! What the commands are told that drive a log over a map: `localize` and `track`.

use std::path::{Path, PathBuf};

use anyhow::Context;
use clap::Args;
use curionav_deployment::files::{self, MapFiles};
use curionav_localization::LocalizerParams;
use curionav_planning::geometry::Pose2;
use curionav_planning::motion::OdometryNoise;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::parameters;
use curionav_runtime::convert;

use super::arguments::{LogFiles, pose, range_max, within};
use super::carmen::Scanner;
use super::robot_file::RobotFile;
use super::{Log, Recorded, recorded};

/// What every MCAP file begins with.
const MCAP_MAGIC: &[u8] = b"\x89MCAP0\r\n";

/// Reads what a recording holds of the robot of that name, or of its only one.
pub type RecordingReader = dyn Fn(&Path, Option<&str>) -> anyhow::Result<Recorded>;

/// The log, the map, and how the localiser starts.
#[derive(Debug, Args)]
pub struct DriveArguments {
    /// The log, or the recording.
    #[arg(value_name = "LOG")]
    pub(crate) path: PathBuf,
    /// The map: a map_server YAML file. Default: that of the recording.
    #[arg(long, value_name = "MAP.yaml")]
    pub(crate) map: Option<PathBuf>,
    /// The robot, if the recording has several.
    #[arg(long, value_name = "NAME")]
    robot: Option<String>,
    /// Another log of the same scans, whose poses are the references.
    #[arg(long, value_name = "LOG")]
    reference: Option<PathBuf>,
    /// Where the robot starts on the map, metres and radians. Default: where the first reference is.
    #[arg(long, value_name = "X,Y,HEADING", value_parser = pose, allow_hyphen_values = true, conflicts_with = "global")]
    start: Option<Pose2>,
    /// Start anywhere on the map.
    #[arg(long)]
    global: bool,
    /// Where the laser sits on the robot, metres and radians. Default: as the log says, else in the robot's centre.
    #[arg(long, value_name = "X,Y,HEADING", value_parser = pose, allow_hyphen_values = true)]
    laser: Option<Pose2>,
    /// Ranges from here on met nothing, metres.
    #[arg(long, value_name = "M", default_value_t = 30.0, value_parser = range_max)]
    range_max: f64,
    /// How many times greater the variances of odometry are than the usual ones, which fit most published logs.
    #[arg(long, value_name = "N", default_value_t = 1.0, value_parser = odometry_noise, conflicts_with = "robot_file")]
    odometry_noise: f64,
    /// How long before their stamps scans were taken, seconds.
    #[arg(long, value_name = "S", default_value_t = 0.0, value_parser = laser_delay, conflicts_with = "robot_file")]
    laser_delay: f64,
    /// The robot's configuration, such as one that `localize --fit` wrote: noise of odometry and delay of the laser.
    #[arg(long, value_name = "FILE")]
    robot_file: Option<PathBuf>,
    /// Only the part of the log between these times, seconds after its first scan.
    #[arg(long, value_name = "FROM,TO", value_parser = part)]
    seconds: Option<(f64, f64)>,
    /// Parameters of the localiser (.toml), as in the table `localizer` of a scenario.
    #[arg(long, value_name = "FILE")]
    localizer: Option<PathBuf>,
    /// Seed of the particles.
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
}

fn odometry_noise(text: &str) -> Result<f64, String> {
    within(text, 0.0, 10_000.0)
}

fn laser_delay(text: &str) -> Result<f64, String> {
    within(text, 0.0, 1.0)
}

fn part(text: &str) -> Result<(f64, f64), String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[from, to]) if 0.0 <= from && from < to => Ok((from, to)),
        _ => Err("give two times with a comma between them, such as 0,300".into()),
    }
}

/// Where the filter starts.
#[derive(Debug, Clone, Copy)]
pub(crate) enum Start {
    At(Pose2),
    Anywhere,
}

/// A log with its map, ready to be driven.
pub(crate) struct Given {
    pub(crate) log: Log,
    /// How long before their stamps its scans were taken, seconds.
    pub(crate) delay_s: f64,
    /// What the references of the log are, in words.
    pub(crate) references_are: String,
    pub(crate) map: StaticMap,
    pub(crate) start: Start,
    /// Those of the localiser.
    pub(crate) params: LocalizerParams,
    pub(crate) noise: OdometryNoise,
}

impl DriveArguments {
    /// Reads log, map and parameters.
    ///
    /// # Errors
    /// A file cannot be read, there is no map, or nothing says where the robot starts.
    pub(crate) fn read(&self, reader: &RecordingReader) -> anyhow::Result<Given> {
        let scanner = Scanner { range_max: self.range_max, robot_from_laser: self.laser };
        let files = LogFiles { log: &self.path, reference: self.reference.as_deref(), scanner };
        let mut map = None;
        let mut references_are = "poses of the log".to_owned();
        let mut log = if files::begins_with(&self.path, MCAP_MAGIC)? {
            let recorded = reader(&self.path, self.robot.as_deref())?;
            let log = recorded::log(&recorded, scanner);
            let (mut log, what) = log.with_context(|| self.path.display().to_string())?;
            files.take_references(&mut log)?;
            (map, references_are) = (recorded.map, what.to_owned());
            log
        } else {
            files.read_carmen()?
        };
        if let Some(path) = &self.reference {
            references_are = format!("poses of {}", path.display());
        }
        if let Some((from, to)) = self.seconds {
            log = log.part(from, to);
            anyhow::ensure!(!log.readings.is_empty(), "--seconds: the log has no scan between these times");
        }
        let grid = match (&self.map, map) {
            (Some(path), _) => MapFiles::read(path)?.grid()?,
            (None, Some(map)) => convert::occupancy_grid(map)?,
            (None, None) => anyhow::bail!("{}: it has no map: give --map", self.path.display()),
        };
        let start = self.start(&log)?;
        let params = self.params()?;
        let RobotFile { noise, delay_s } = match &self.robot_file {
            Some(path) => RobotFile::read(path)?,
            None => RobotFile::of_arguments(self.odometry_noise, self.laser_delay),
        };
        Ok(Given { log, delay_s, references_are, map: StaticMap::new(grid), start, params, noise })
    }

    fn params(&self) -> anyhow::Result<LocalizerParams> {
        let Some(path) = &self.localizer else { return Ok(LocalizerParams::default()) };
        let text = files::text(path)?;
        parameters::read::<LocalizerParams>(&text).with_context(|| path.display().to_string())
    }

    fn start(&self, log: &Log) -> anyhow::Result<Start> {
        match (self.start, log.readings.iter().find_map(|reading| reading.reference)) {
            _ if self.global => Ok(Start::Anywhere),
            (Some(pose), _) | (None, Some(pose)) => Ok(Start::At(pose)),
            (None, None) => {
                let problem = "the log has no poses beside odometry: give --start, --global or --reference";
                anyhow::bail!("{}: {problem}", self.path.display());
            }
        }
    }
}
