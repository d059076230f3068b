//! What a robot's configuration says of its odometry and its laser.

use std::path::Path;

use anyhow::Context;
use curionav_deployment::files;
use curionav_planning::motion::OdometryNoise;
use curionav_planning::parameters::read_table;
use curionav_runtime::scanner_limits::ScannerLimits;

/// The part of it that a localiser needs.
pub(crate) struct RobotFile {
    pub(crate) noise: OdometryNoise,
    /// How long before its stamp a scan was taken, seconds.
    pub(crate) delay_s: f64,
}

impl RobotFile {
    /// A base whose odometry has so many times the variances of the simulated one.
    pub(crate) fn of_arguments(times: f64, delay_s: f64) -> Self {
        let simulated = OdometryNoise::default();
        let noise = OdometryNoise {
            position_per_metre: times * simulated.position_per_metre,
            position_per_radian: times * simulated.position_per_radian,
            heading_per_metre: times * simulated.heading_per_metre,
            heading_per_radian: times * simulated.heading_per_radian,
        };
        Self { noise, delay_s }
    }

    /// Reads `[scanner]` and `[ros2.mission.odometry_noise]`; what is missing has its default.
    ///
    /// # Errors
    /// If the file cannot be read, or a field of these tables is wrong.
    pub(crate) fn read(path: &Path) -> anyhow::Result<Self> {
        let shown = || path.display().to_string();
        let text = files::text(path)?;
        let file: toml::Table = toml::from_str(&text).with_context(shown)?;
        let empty = toml::Table::new();
        let noise = ["ros2", "mission", "odometry_noise"]
            .iter()
            .try_fold(&file, |table, name| table.get(*name)?.as_table());
        let noise = read_table(noise.unwrap_or(&empty));
        let noise = noise.map_err(|fault| {
            anyhow::anyhow!("{}: {}", shown(), fault.below("ros2.mission.odometry_noise"))
        })?;
        let scanner = file.get("scanner").and_then(toml::Value::as_table);
        let scanner: ScannerLimits = read_table(scanner.unwrap_or(&empty))
            .map_err(|fault| anyhow::anyhow!("{}: {}", shown(), fault.below("scanner")))?;
        Ok(Self { noise, delay_s: scanner.delay_s })
    }
}
