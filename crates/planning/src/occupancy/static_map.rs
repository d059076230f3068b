//! A map together with the fields that depend on nothing else.

use std::sync::Arc;

use crate::geometry::Point2;
use crate::occupancy::way::{OffWay, Way};
use crate::occupancy::{DistanceField, Obstacles, OccupancyGrid};
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
    /// Distance to what a robot must not touch: occupied or unknown cells, and keepout zones.
    pub to_obstacle: Arc<DistanceField>,
    /// Distance to what a laser beam ends on: occupied cells.
    pub to_occupied: Arc<DistanceField>,
    /// What leaving the way costs that the robot is to keep to; none if it may choose its way.
    pub off_way: Option<OffWay>,
}

impl StaticMap {
    /// Bytes of memory.
    pub fn bytes(&self) -> usize {
        self.grid.cells().len()
            + self.grid.limits().len()
            + self.to_obstacle.bytes()
            + self.to_occupied.bytes()
            + self.off_way.as_ref().map_or(0, OffWay::bytes)
    }

    /// The map with these cells as well to keep clear of. Its grid stays: what beams end on, the map says.
    ///
    /// Distances to them are exact as far as [`DistanceField::NEAR`], and no less than that beyond.
    #[must_use]
    pub fn with_obstacles(&self, obstacles: &Obstacles) -> Self {
        let places = obstacles.places(&self.grid);
        let cells: Vec<usize> = places.map(|(column, row)| self.grid.index(column, row)).collect();
        Self { to_obstacle: Arc::new(self.to_obstacle.with_targets(&cells)), ..self.clone() }
    }

    /// The map for a robot that is to keep to a way.
    #[must_use]
    pub fn along(&self, way: &Way) -> Self {
        Self { off_way: Some(way.on(&self.grid)), ..self.clone() }
    }

    /// The number of the way that the robot is to keep to; 0 without one.
    pub fn way(&self) -> u64 {
        self.off_way.as_ref().map_or(0, |off| off.id)
    }

    /// What a metre in a cell counts as because of that way.
    pub(super) fn way_factor(&self, index: usize) -> f64 {
        self.off_way.as_ref().map_or(1.0, |off| off.factor(index))
    }

    /// The map without its zones: what is really there.
    #[must_use]
    pub fn without_zones(&self) -> Self {
        if self.grid.limits().is_empty() { self.clone() } else { Self::new(self.grid.without_zones()) }
    }

    /// Derives the fields of `grid`.
    pub fn new(grid: OccupancyGrid) -> Self {
        Self::by(&Alone, grid)
    }

    /// The most room, metres, to what a robot must not touch that any place within `reach` metres of `p` has; none if
    /// `p` is not on the map. It is never too little: from the centre of its cell a place is half a diagonal away at
    /// most, and an obstacle reaches half a cell at least from the centre of its own.
    pub fn most_room(&self, p: Point2, reach: f64) -> Option<f64> {
        let grid = &self.grid;
        let (column, row) = grid.locate(p)?;
        let half_diagonal = std::f64::consts::FRAC_1_SQRT_2 * grid.resolution();
        let beyond_centres = half_diagonal - 0.5 * grid.resolution();
        let cells = (reach / grid.resolution()).ceil() as usize + 1;
        let near = grid.around(column, row, cells);
        let near = near.filter(|&(c, r)| grid.centre(c, r).distance(p) <= reach + 1.001 * half_diagonal);
        let room = near.map(|(c, r)| self.to_obstacle.cell(grid.index(c, r))).fold(0.0, f64::max);
        Some(if room > 0.0 { room + beyond_centres } else { 0.0 })
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
        Self { grid: Arc::new(grid), to_obstacle, to_occupied, off_way: None }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;

    /// 4 m by 2 m in cells of 5 cm: the right half is a wall, and the upper half of the left one unknown.
    fn map() -> StaticMap {
        let cell = |i: usize| match (i % 80, i / 80) {
            (40.., _) => 100,
            (_, 20..) => -1,
            _ => 0,
        };
        StaticMap::new(
            OccupancyGrid::new(80, 40, 0.05, Pose2::default(), (0..80 * 40).map(cell).collect()).unwrap(),
        )
    }

    #[test]
    fn room_is_where_neither_walls_nor_unknown_floor_are_and_never_too_little() {
        let map = map();
        let most = |x: f64, y: f64, reach: f64| map.most_room(Point2::new(x, y), reach).unwrap();
        // Half a metre from both; the border of the grid is no wall here.
        let here = most(1.5, 0.5, 0.0);
        assert!((0.5..0.65).contains(&here), "{here}");
        // In the wall and in the unknown, and as far as free floor is in reach.
        for (x, y) in [(3.0, 0.5), (1.0, 1.5)] {
            assert_eq!(most(x, y, 0.2), 0.0, "({x}, {y})");
        }
        let through = most(2.3, 0.5, 0.5);
        assert!((0.2..0.35).contains(&through), "{through}");
        assert!(most(2.3, 0.5, 0.9) > 0.5);
        assert_eq!(map.most_room(Point2::new(-0.1, 0.5), 0.5), None);
    }
}
