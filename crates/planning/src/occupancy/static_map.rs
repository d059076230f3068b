//! A map together with the fields that depend on nothing else.

use std::sync::Arc;

use crate::occupancy::{DistanceField, OccupancyGrid};
use crate::workers::{Alone, Workers};

/// Grid and distance fields, computed once per map and shared.
///
/// ```
/// use curionav_planning::geometry::{Point2, Pose2};
/// use curionav_planning::occupancy::{GeodesicField, OccupancyGrid, StaticMap};
///
/// // 4 m by 2 m, the right half occupied.
/// let cells = (0..40 * 20).map(|i| if i % 40 < 20 { 0 } else { 100 }).collect();
/// let map = StaticMap::new(OccupancyGrid::new(40, 20, 0.1, Pose2::default(), cells)?);
/// let goal = Point2::new(0.5, 1.0);
/// assert!((map.to_obstacle.at(&map.grid, goal) - 1.5).abs() < 0.11);
/// let to_goal = GeodesicField::new(&map, goal, 0.3);
/// assert!((to_goal.at(Point2::new(1.0, 1.0)) - 0.5).abs() < 0.1);
/// # Ok::<(), curionav_planning::occupancy::GridError>(())
/// ```
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
    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.grid.cells().len() + self.to_obstacle.bytes() + self.to_occupied.bytes()
    }

    /// Derives the fields of `grid`.
    pub fn new(grid: OccupancyGrid) -> Self {
        Self::by(&Alone, grid)
    }

    /// The same, in pieces that `workers` do.
    pub fn by(workers: &dyn Workers, grid: OccupancyGrid) -> Self {
        let mut to_obstacle = None;
        let mut to_occupied = None;
        workers.run(vec![
            Box::new(|| to_obstacle = Some(DistanceField::to_obstacle(&grid))),
            Box::new(|| to_occupied = Some(DistanceField::to_occupied(&grid))),
        ]);
        let to_obstacle = Arc::new(to_obstacle.unwrap_or_else(|| DistanceField::to_obstacle(&grid)));
        let to_occupied = Arc::new(to_occupied.unwrap_or_else(|| DistanceField::to_occupied(&grid)));
        Self { grid: Arc::new(grid), to_obstacle, to_occupied }
    }
}
