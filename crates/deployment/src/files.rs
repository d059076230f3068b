//! Files read and written, with errors that name them.

use std::fs;
use std::path::Path;

use anyhow::Context;

/// What is in a file.
pub fn bytes(path: &Path) -> anyhow::Result<Vec<u8>> {
    fs::read(path).with_context(|| format!("cannot read {}", path.display()))
}

/// Makes the directory, and those above it, if need be.
pub fn make_folder(path: &Path) -> anyhow::Result<()> {
    fs::create_dir_all(path).with_context(|| format!("cannot create {}", path.display()))
}

/// Writes the file, in place of one that is there, and makes its directory if need be.
pub fn write(path: &Path, content: impl AsRef<[u8]>) -> anyhow::Result<()> {
    path.parent().map_or(Ok(()), make_folder)?;
    fs::write(path, content).with_context(|| format!("cannot write {}", path.display()))
}
