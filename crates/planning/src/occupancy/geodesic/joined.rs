//! Cells of a map that are joined.

use std::ops::Range;
use std::sync::Arc;

use crate::geometry::Point2;
use crate::occupancy::OccupancyGrid;

/// How far around the goal distances are exact, joined cells: behind one that is farther away there may be a wall.
pub(super) const EXACT_CELLS: usize = 1;

/// Cost factor of cells in which the robot fits between walls and does not fit beside obstacles. A way around is longer
/// than it seems, and what is closed is to be left, not pushed through.
pub(super) const CLOSED_SLOWNESS: f64 = 60.0;

/// What joined cells count as for one robot.
#[derive(Debug, Clone)]
pub(super) struct Joined {
    pub(super) grid: Arc<OccupancyGrid>,
    /// Metres that each cell counts as, with a border of one impassable cell around them.
    pub(super) slowness: Vec<f32>,
}

impl Joined {
    /// Impassable cells.
    pub(super) fn new(grid: OccupancyGrid) -> Self {
        let slowness = vec![f32::INFINITY; (grid.width() + 2) * (grid.height() + 2)];
        Self { grid: Arc::new(grid), slowness }
    }

    /// Sets what a metre in a cell counts as.
    pub(super) fn set(&mut self, (column, row): (usize, usize), factor: f64) {
        let place = self.bordered(column, row);
        self.slowness[place] = (factor * self.grid.resolution()) as f32;
    }

    /// The cells of a part, with a border of one impassable cell.
    pub(super) fn part(&self, columns: &Range<usize>, rows: &Range<usize>) -> Vec<f32> {
        let mut part = vec![f32::INFINITY; (columns.len() + 2) * (rows.len() + 2)];
        for (row, cells) in rows.clone().zip(part.chunks_exact_mut(columns.len() + 2).skip(1)) {
            let first = self.bordered(columns.start, row);
            cells[1..=columns.len()].copy_from_slice(&self.slowness[first..first + columns.len()]);
        }
        part
    }

    /// Whether obstacles leave the robot no room at a point.
    pub(super) fn is_closed(&self, p: Point2) -> bool {
        let closed = (CLOSED_SLOWNESS * self.grid.resolution()) as f32;
        let place = self.grid.locate(p);
        place.is_some_and(|(column, row)| self.slowness[self.bordered(column, row)] == closed)
    }

    fn bordered(&self, column: usize, row: usize) -> usize {
        (row + 1) * (self.grid.width() + 2) + column + 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;

    #[test]
    fn a_part_is_what_the_whole_has_there() {
        let grid = OccupancyGrid::new(5, 4, 0.2, Pose2::default(), vec![0; 20]).unwrap();
        let mut joined = Joined::new(grid);
        joined.set((3, 2), 2.0);
        joined.set((4, 2), CLOSED_SLOWNESS);
        assert_eq!(joined.part(&(0..5), &(0..4)), joined.slowness);
        let part = joined.part(&(3..5), &(2..3));
        assert_eq!((part.len(), part[5], part[6]), (12, 0.4, 12.0));
        assert_eq!(part.iter().filter(|cell| cell.is_finite()).count(), 2);
        assert!(joined.is_closed(Point2::new(0.9, 0.5)) && !joined.is_closed(Point2::new(0.7, 0.5)));
        assert!(!joined.is_closed(Point2::new(-1.0, 0.5)));
    }
}
