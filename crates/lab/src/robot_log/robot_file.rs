//! What a robot's configuration says of its odometry and its laser.

use std::path::Path;

use anyhow::Context;
use curionav_deployment::files;
use curionav_planning::motion::OdometryNoise;
use curionav_planning::parameters::{Ranged, read_table};
use curionav_runtime::scanner_limits::ScannerLimits;
use serde::de::DeserializeOwned;

/// The part of it that a localiser needs.
pub(crate) struct RobotFile {
    pub(crate) noise: OdometryNoise,
    /// How long before its stamp a scan was taken, seconds.
    pub(crate) delay_s: f64,
}

impl RobotFile {
    /// A base whose odometry has so many times the usual variances.
    pub(crate) fn of_arguments(times: f64, delay_s: f64) -> Self {
        let usual = OdometryNoise::default();
        let noise = OdometryNoise {
            position_per_metre: times * usual.position_per_metre,
            position_per_radian: times * usual.position_per_radian,
            heading_per_metre: times * usual.heading_per_metre,
            heading_per_radian: times * usual.heading_per_radian,
        };
        Self { noise, delay_s }
    }

    /// Reads `[scanner]` and `[ros2.mission.odometry_noise]`; what is missing has its default.
    ///
    /// # Errors
    /// If the file cannot be read, or a field of these tables is wrong.
    pub(crate) fn read(path: &Path) -> anyhow::Result<Self> {
        let text = files::text(path)?;
        let file = toml::from_str(&text).with_context(|| path.display().to_string())?;
        let scanner: ScannerLimits = table(&file, path, &["scanner"])?;
        Ok(Self {
            noise: table(&file, path, &["ros2", "mission", "odometry_noise"])?,
            delay_s: scanner.delay_s,
        })
    }
}

/// The table of these names, each within the one before, or its defaults.
fn table<T: Ranged + DeserializeOwned>(file: &toml::Table, path: &Path, names: &[&str]) -> anyhow::Result<T> {
    let found = names.iter().try_fold(file, |table, name| table.get(*name)?.as_table());
    let read = read_table(found.unwrap_or(&toml::Table::new()));
    read.map_err(|fault| anyhow::anyhow!("{}: {}", path.display(), fault.below(&names.join("."))))
}
