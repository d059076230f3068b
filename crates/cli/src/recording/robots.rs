//! Of which robot the messages of a recording are read.

use std::collections::BTreeSet;
use std::path::Path;

/// Makes sure that the messages read from the recording at `path` are of one robot; `robots` are the names in them.
///
/// # Errors
/// If messages of several robots were found, with their names.
pub(super) fn only_one(path: &Path, robots: &BTreeSet<String>) -> anyhow::Result<()> {
    let names = Vec::from_iter(robots.iter().map(String::as_str)).join(", ");
    let path = path.display();
    anyhow::ensure!(robots.len() < 2, "{path} holds several robots, name one with --robot: {names}");
    Ok(())
}
