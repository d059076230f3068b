//! What planners are tuned on: layouts that no report uses.

use super::files::File;
use super::{dense, rooms};

/// Random stream of the floor plans, another one than that of `rooms`.
const STREAM: u64 = 0x5452_4149;
/// Floor plans of each use.
const PLANS: u64 = 2;

pub(super) fn files() -> anyhow::Result<Vec<File>> {
    let mut files = rooms::drawn_plans("training", STREAM, PLANS)?;
    files.extend(dense::training()?);
    Ok(files)
}
