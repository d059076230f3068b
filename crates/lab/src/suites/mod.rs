//! The suites of scenarios that `curionav bench` runs, as they are committed below `scenarios/`.
//!
//! - `paper`: the thirteen scenes of [`crate::paper`], whose people leave a lane free (D16);
//! - `open`: the same halls, numbers of people and tasks, with people anywhere on the floor;
//! - `dense`: corridor, crossing, door and plaza at four densities, without a free lane;
//! - `rooms`: floor plans and tasks drawn at random, and the same on published maps;
//! - `halls`: halls drawn at random, with people anywhere;
//! - `recorded`: people as they were filmed, each part of a film with a task of its own;
//! - `training`: floor plans, a passage and crowds that are in none of the others, for `curionav tune`.
//!
//! - `narrow`: doors and aisles by width, empty and with people;
//! - `changed`: floors on which things have been moved, put down and closed since the map was made, and the same floors
//!   with a map that is right (`changed-mapped`); `closed` and `reopened`: the only way is closed.
//!
//! In all but `paper` and `recorded`, the run's seed draws the people: ten seeds are ten crowds. They walk 0.8 to 1.6
//! m/s; a third of them walk in groups, and a fifth take no notice of the robot. The people of `paper` are the paper's.

mod changed;
mod dense;
mod files;
mod floor_plan;
mod halls;
mod narrow;
mod open;
mod recorded;
mod rooms;
mod training;

use crate::paper;

pub use files::File;

/// Everything that is generated below `scenarios/`, in a fixed order. Scenarios on published maps are left out where
/// the maps are not at hand; the second list says which.
pub fn committed() -> anyhow::Result<(Vec<File>, Vec<String>)> {
    let mut files = paper::committed()?;
    files.extend(open::files()?);
    files.extend(dense::files()?);
    files.extend(rooms::generated()?);
    files.extend(halls::files()?);
    files.extend(recorded::files()?);
    files.extend(training::files()?);
    files.extend(narrow::files()?);
    files.extend(changed::files()?);
    let (published, missing) = rooms::published()?;
    files.extend(published);
    Ok((files, missing))
}

#[cfg(test)]
mod tests;
