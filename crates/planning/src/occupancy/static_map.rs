//! A map together with the fields that depend on nothing else.

use std::sync::Arc;

use crate::occupancy::{DistanceField, OccupancyGrid};

/// Grid and distance fields, computed once per map and shared.
#[derive(Debug, Clone)]
pub struct StaticMap {
    /// The grid itself.
    pub grid: Arc<OccupancyGrid>,
    /// Distance to what a robot must not touch: occupied or unknown cells.
    pub to_obstacle: Arc<DistanceField>,
    /// Distance to what a laser beam ends on: occupied cells.
    pub to_occupied: Arc<DistanceField>,
}

impl StaticMap {
    /// Derives the fields of `grid`.
    pub fn new(grid: OccupancyGrid) -> Self {
        let to_obstacle = Arc::new(DistanceField::to_obstacle(&grid));
        let to_occupied = Arc::new(DistanceField::to_occupied(&grid));
        Self { grid: Arc::new(grid), to_obstacle, to_occupied }
    }
}
