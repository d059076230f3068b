//! Where a robot was last sure to be, kept in a file, so that a localizer or a gateway that is started again need not
//! ask for it.

use std::fs;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

use curionav_schemas::Pose;
use serde::{Deserialize, Serialize};

/// The last sure belief of a robot.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptPose {
    /// The robot's name.
    pub robot: String,
    /// The map, by hash.
    pub map: String,
    /// Run in which it was believed.
    pub run: u64,
    /// Tick of the belief.
    pub tick: u64,
    /// Odometry of that tick, odometry frame.
    pub odometry: Pose,
    /// Where the robot was, map frame.
    pub pose: Pose,
}

/// Why a file has no pose that can be used.
#[derive(Debug, thiserror::Error)]
pub enum KeptPoseError {
    /// It cannot be read.
    #[error("{path}: {error}")]
    Read {
        /// The file.
        path: String,
        /// Why.
        error: io::Error,
    },
    /// It is none that was kept.
    #[error("{path}: {error}; remove the file, and give an initial pose")]
    Malformed {
        /// The file.
        path: String,
        /// Why.
        error: serde_json::Error,
    },
}

impl KeptPose {
    /// The pose kept in a file; none if there is no such file yet.
    pub fn read(path: &Path) -> Result<Option<Self>, KeptPoseError> {
        let bytes = match fs::read(path) {
            Ok(bytes) => bytes,
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
            Err(error) => return Err(KeptPoseError::Read { path: path.display().to_string(), error }),
        };
        let kept = serde_json::from_slice(&bytes);
        kept.map(Some).map_err(|error| KeptPoseError::Malformed { path: path.display().to_string(), error })
    }

    /// Writes it whole or not at all: power may fail at any moment.
    pub fn write(&self, path: &Path) -> io::Result<()> {
        let mut new = path.as_os_str().to_owned();
        new.push(".new");
        let new = PathBuf::from(new);
        let mut file = fs::File::create(&new)?;
        file.write_all(&serde_json::to_vec(self)?)?;
        file.sync_all()?;
        fs::rename(&new, path)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept() -> KeptPose {
        let pose = |x: f64| Pose { x, y: 2.0, heading: -0.25 };
        KeptPose {
            robot: "r1".into(),
            map: "9f".repeat(32),
            run: 7,
            tick: 120,
            odometry: pose(0.5),
            pose: pose(12.5),
        }
    }

    #[test]
    fn what_is_kept_is_read_again_and_a_file_that_is_none_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("pose.json");
        assert!(KeptPose::read(&path).unwrap().is_none());
        kept().write(&path).unwrap();
        KeptPose { tick: 121, ..kept() }.write(&path).unwrap();
        assert_eq!(KeptPose::read(&path).unwrap(), Some(KeptPose { tick: 121, ..kept() }));
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 1);
        fs::write(&path, "{\"robot\": 3}").unwrap();
        let error = KeptPose::read(&path).unwrap_err().to_string();
        assert!(error.contains("pose.json") && error.contains("give an initial pose"), "{error}");
    }
}
