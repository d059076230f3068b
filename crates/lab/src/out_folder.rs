//! The directory that `--out` names, and files in it.

use std::path::{Path, PathBuf};

use anyhow::Context;

/// Makes the directory `name` in `out`, and `out` if need be.
pub(crate) fn folder(out: &Path, name: &str) -> anyhow::Result<PathBuf> {
    let folder = out.join(name);
    std::fs::create_dir_all(&folder).with_context(|| format!("--out: cannot create {}", folder.display()))?;
    Ok(folder)
}

pub(crate) fn write(path: &Path, content: &str) -> anyhow::Result<()> {
    std::fs::write(path, content).with_context(|| format!("cannot write {}", path.display()))
}
