//! How the commands that read logs are told of files and poses.

use std::path::Path;

use anyhow::Context;
use curionav_deployment::files;
use curionav_planning::geometry::Pose2;

use super::Log;
use super::carmen::{self, Scanner};

/// The files of one log.
#[derive(Debug, Clone, Copy)]
pub(crate) struct LogFiles<'a> {
    /// Of the Carmen toolkit, or of GMapping.
    pub(crate) log: &'a Path,
    /// Another log of the same scans, whose poses are the references.
    pub(crate) reference: Option<&'a Path>,
    /// What the log does not say.
    pub(crate) scanner: Scanner,
}

impl LogFiles<'_> {
    /// Reads the log and the references.
    ///
    /// # Errors
    /// A file cannot be read, most of its lines cannot, or no reference is of the time of a scan.
    pub(crate) fn read_carmen(&self) -> anyhow::Result<Log> {
        let mut log = self.parsed(self.log)?;
        self.take_references(&mut log)?;
        Ok(log)
    }

    /// Gives a log that was read elsewhere the references.
    ///
    /// # Errors
    /// See [`Self::read_carmen`].
    pub(crate) fn take_references(&self, log: &mut Log) -> anyhow::Result<()> {
        let Some(path) = self.reference else { return Ok(()) };
        let poses = self.parsed(path)?.readings;
        // Poses without odometry beside them are references all the same.
        let poses: Vec<_> = poses.iter().map(|r| (r.stamp, r.reference.unwrap_or(r.odometry))).collect();
        let taken = log.take_references(&poses);
        anyhow::ensure!(
            taken > 0,
            "{}: no scan is within 0.05 s of one of {}: are they of the same drive?",
            path.display(),
            self.log.display()
        );
        Ok(())
    }

    fn parsed(&self, path: &Path) -> anyhow::Result<Log> {
        let text = files::bytes(path)?;
        let log = carmen::parse(&String::from_utf8_lossy(&text), self.scanner);
        log.with_context(|| path.display().to_string())
    }
}

/// A pose as an argument: `1.5,-2,0`, metres and radians.
pub(crate) fn pose(text: &str) -> Result<Pose2, String> {
    let numbers: Result<Vec<f64>, _> = text.split(',').map(|part| part.trim().parse::<f64>()).collect();
    match numbers.as_deref() {
        Ok(&[x, y, heading]) if [x, y, heading].iter().all(|n| n.abs() <= 1e6) => {
            Ok(Pose2::new(x, y, heading))
        }
        _ => Err("give three numbers with commas between them, such as 1.5,-2,0".into()),
    }
}

/// A greatest range as an argument, metres.
pub(crate) fn range_max(text: &str) -> Result<f64, String> {
    within(text, 1.0, 200.0)
}

/// A number between two others as an argument.
pub(crate) fn within(text: &str, least: f64, most: f64) -> Result<f64, String> {
    let number: f64 = text.parse().map_err(|error| format!("{error}"))?;
    if (least..=most).contains(&number) {
        Ok(number)
    } else {
        Err(format!("it must be from {least} to {most}"))
    }
}
