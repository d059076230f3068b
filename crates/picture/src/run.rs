//! Everything about one run that its page shows.

use super::trace_columns::TraceColumns;
use curionav_schemas::{CycleReport, OccupancyGrid, RunResult};

/// The run; lengths in metres, in the map frame.
pub(super) struct Run<'a> {
    pub(super) result: &'a RunResult,
    pub(super) reports: &'a [CycleReport],
    pub(super) map: &'a OccupancyGrid,
    pub(super) trace: TraceColumns,
    pub(super) goal: (f64, f64),
    pub(super) robot_radius: f64,
    pub(super) goal_tolerance: f64,
    pub(super) person_radius: f64,
}
