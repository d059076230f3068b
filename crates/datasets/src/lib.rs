//! Where the files of published datasets lie.
//!
//! A scenario names such a file `dataset:NAME/FILE`. It is the file `NAME/FILE` in the folder that the environment
//! variable `CURIONAV_DATA` names, by default `curionav` in the user's cache directory (on Linux `~/.cache/curionav`).
//! `python -m curionav.datasets NAME` downloads a dataset into the same folder; nothing here downloads.

use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// What the name of a dataset's file begins with in a scenario.
const PREFIX: &str = "dataset:";

/// Why a file of a dataset is not at hand.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum DatasetError {
    /// The reference has not the form `dataset:NAME/FILE`.
    #[error("`{0}` names no file of a dataset; write `dataset:NAME/FILE`, without `..`")]
    Malformed(String),
    /// The file is not in the folder of datasets.
    #[error(
        "there is no file {}; `python -m curionav.datasets {name}` downloads it, and CURIONAV_DATA names the \
         folder of datasets",
        path.display()
    )]
    Missing {
        /// Which dataset.
        name: String,
        /// Where the file should be.
        path: PathBuf,
    },
    /// `CURIONAV_DATA` is not set, and the system does not say where the user's cache directory is.
    #[error("the user's cache directory is unknown here; set CURIONAV_DATA to the folder of datasets")]
    NoFolder,
}

/// The path of a file that a scenario names: `dataset:NAME/FILE` is a file of a dataset, which must exist; any other
/// name is a path that starts from `directory`, the scenario's own.
pub fn locate(file: &str, directory: &Path) -> Result<PathBuf, DatasetError> {
    match file.strip_prefix(PREFIX) {
        Some(_) => in_folder(file, &folder(std::env::var_os("CURIONAV_DATA"), dirs::cache_dir())?),
        None => Ok(directory.join(file)),
    }
}

/// The folder of datasets. An empty variable counts as none.
fn folder(variable: Option<OsString>, cache: Option<PathBuf>) -> Result<PathBuf, DatasetError> {
    match variable.filter(|value| !value.is_empty()) {
        Some(named) => Ok(PathBuf::from(named)),
        None => cache.map(|cache| cache.join("curionav")).ok_or(DatasetError::NoFolder),
    }
}

fn in_folder(file: &str, folder: &Path) -> Result<PathBuf, DatasetError> {
    let parts: Vec<&str> = file.trim_start_matches(PREFIX).split('/').collect();
    if parts.len() < 2 || parts.iter().any(|part| matches!(*part, "" | "." | "..") || part.contains('\\')) {
        return Err(DatasetError::Malformed(file.to_owned()));
    }
    let path = folder.join(parts.iter().collect::<PathBuf>());
    if path.is_file() { Ok(path) } else { Err(DatasetError::Missing { name: parts[0].to_owned(), path }) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_without_the_prefix_is_a_path_from_the_scenarios_directory() {
        assert_eq!(locate("maps/hall.yaml", Path::new("scenarios")), Ok("scenarios/maps/hall.yaml".into()));
    }

    #[test]
    fn a_reference_is_a_file_below_the_folder() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR"));
        assert_eq!(in_folder("dataset:src/lib.rs", folder), Ok(folder.join("src/lib.rs")));
    }

    #[test]
    fn a_missing_file_is_answered_with_the_command_that_downloads_it() {
        let error = in_folder("dataset:maps/a/b.yaml", Path::new("nowhere")).unwrap_err().to_string();
        assert!(error.starts_with("there is no file nowhere/maps/a/b.yaml; "), "{error}");
        assert!(error.contains("`python -m curionav.datasets maps` downloads it"), "{error}");
        let directory = in_folder("dataset:src/tests", Path::new("src")).unwrap_err();
        assert!(matches!(directory, DatasetError::Missing { .. }));
    }

    #[test]
    fn a_reference_cannot_leave_the_folder() {
        for file in [
            "maps",
            "maps/",
            "/etc/passwd",
            "../maps/a.yaml",
            "maps/../../a.yaml",
            "maps/./a",
            "maps/..\\a",
            "",
        ] {
            let file = format!("dataset:{file}");
            assert_eq!(in_folder(&file, Path::new("")), Err(DatasetError::Malformed(file)));
        }
    }

    #[test]
    fn the_variable_names_the_folder_and_the_cache_is_the_default() {
        let cache = || Some(PathBuf::from("cache"));
        assert_eq!(folder(Some("data".into()), cache()), Ok("data".into()));
        assert_eq!(folder(Some("".into()), cache()), Ok("cache/curionav".into()));
        assert_eq!(folder(None, cache()), Ok("cache/curionav".into()));
        assert_eq!(folder(None, None), Err(DatasetError::NoFolder));
    }
}
