//! Scenarios inside the program as commands find them.

use std::path::{Path, PathBuf};

pub(crate) use curionav_in_process::built_in::BuiltIn;

use crate::files;
use curionav_in_process::built_in::ALL;

/// The scenario that a command line means by `path`: a name without extension, unless a file is called so.
pub(crate) fn find(path: &Path) -> Option<&'static BuiltIn> {
    let named = ALL.iter().find(|one| Path::new(one.name) == path)?;
    (!path.exists()).then_some(named)
}

/// What a scenario may be called, for one that cannot be read.
pub(crate) fn hint() -> String {
    let names: Vec<&str> = ALL.iter().map(|one| one.name).collect();
    format!("a scenario is a TOML file or a built-in name ({})", names.join(", "))
}

/// Writes every built-in scenario and its map into `folder`, as they are under `scenarios/`. Gives the scenarios'
/// files.
///
/// # Errors
/// If a file cannot be written.
pub fn write_all(folder: &Path) -> anyhow::Result<Vec<PathBuf>> {
    let mut written = Vec::new();
    for built_in in &ALL {
        let file = folder.join(built_in.name).with_extension("toml");
        let map = folder.join("maps").join(built_in.name);
        files::write(&map.with_extension("yaml"), built_in.yaml)?;
        files::write(&map.with_extension("pgm"), built_in.image)?;
        files::write(&file, built_in.scenario)?;
        written.push(file);
    }
    Ok(written)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_built_in_and_a_file_is_not() {
        assert!(find(Path::new("quickstart")).is_some());
        assert!(find(Path::new("quickstart.toml")).is_none() && find(Path::new("./quickstart")).is_none());
    }
}
