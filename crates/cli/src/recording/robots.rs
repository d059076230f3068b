//! Whose messages of a recording are meant.

use std::collections::BTreeSet;
use std::path::Path;

/// # Errors
/// If messages of several robots were found, with their names.
pub(super) fn only_one(path: &Path, robots: &BTreeSet<String>) -> anyhow::Result<()> {
    let names = Vec::from_iter(robots.iter().map(String::as_str)).join(", ");
    let path = path.display();
    anyhow::ensure!(robots.len() < 2, "{path} holds several robots, name one with --robot: {names}");
    Ok(())
}
