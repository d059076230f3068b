//! Everything about one run that its page shows.

use super::thing::Thing;
use curionav_schemas::{CycleReport, OccupancyGrid, RunResult};

/// A run to be drawn; lengths in metres, in the map frame.
pub struct Run<'a> {
    /// How it went. Without a trace its picture has no tracks.
    pub result: &'a RunResult,
    /// Every planning cycle, in order; may be empty.
    pub reports: &'a [CycleReport],
    /// The map that the robot was given, with its zones.
    pub map: &'a OccupancyGrid,
    /// The walls that were really there, if they were not those of the map.
    pub truth: Option<&'a OccupancyGrid>,
    /// What was there besides the map.
    pub things: &'a [Thing],
    /// Where the robot was to go.
    pub goal: (f64, f64),
    /// Radius of the robot's body.
    pub robot_radius: f64,
    /// Distance at which the goal counts as reached.
    pub goal_tolerance: f64,
}

impl Run<'_> {
    /// Where it took place.
    pub(super) fn walls(&self) -> &OccupancyGrid {
        self.truth.unwrap_or(self.map)
    }
}
