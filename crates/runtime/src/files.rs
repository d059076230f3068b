//! Reading maps from disk.

use std::path::{Path, PathBuf};

use curionav_planning::occupancy::{MapServerError, MapYaml, OccupancyGrid, load_map};

/// Why a map could not be read.
#[derive(Debug, thiserror::Error)]
pub enum MapFileError {
    /// A file is missing or unreadable.
    #[error("cannot read {path}: {source}")]
    Read {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The yaml or the image is not a map.
    #[error("{path}: {source}")]
    Map {
        /// Which file.
        path: PathBuf,
        /// Why.
        source: MapServerError,
    },
}

/// Reads a map_server yaml and the image it names (relative to the yaml).
pub fn read_map(yaml_path: &Path) -> Result<OccupancyGrid, MapFileError> {
    let read = |path: &Path| {
        std::fs::read(path).map_err(|source| MapFileError::Read { path: path.to_owned(), source })
    };
    let map_error = |path: &Path| {
        let path = path.to_owned();
        move |source| MapFileError::Map { path, source }
    };
    let text = String::from_utf8_lossy(&read(yaml_path)?).into_owned();
    let yaml = MapYaml::parse(&text).map_err(map_error(yaml_path))?;
    let image_path = yaml_path.parent().unwrap_or(Path::new("")).join(&yaml.image);
    load_map(&yaml, &read(&image_path)?).map_err(map_error(&image_path))
}
