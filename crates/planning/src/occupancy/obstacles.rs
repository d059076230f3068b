//! What stands and is on no map.

use std::sync::Arc;

use crate::geometry::Point2;
use crate::occupancy::OccupancyGrid;

/// Cells of a map on which something stands that the map does not have: their indices, ascending. Clones share them.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Obstacles(Arc<[u32]>);

impl Obstacles {
    /// The cells of `map` at these points; points outside the map are left out.
    pub fn at(points: impl IntoIterator<Item = Point2>, map: &OccupancyGrid) -> Self {
        let cells = points.into_iter().filter_map(|p| map.locate(p));
        Self::of(cells.map(|(column, row)| map.index(column, row) as u32).collect())
    }

    /// These cells, in any order.
    pub fn of(mut cells: Vec<u32>) -> Self {
        cells.sort_unstable();
        cells.dedup();
        Self(cells.into())
    }

    /// Indices of the cells, ascending.
    pub fn cells(&self) -> &[u32] {
        &self.0
    }

    /// Columns and rows of the cells on `map`; cells that it does not have are left out.
    pub fn places<'a>(&'a self, map: &'a OccupancyGrid) -> impl Iterator<Item = (usize, usize)> + 'a {
        let cells = self.0.iter().map(|cell| *cell as usize).filter(|cell| *cell < map.cells().len());
        cells.map(|cell| (cell % map.width(), cell / map.width()))
    }

    /// Those that lie within `reach` metres of a point along both axes of `map`.
    #[must_use]
    pub fn near(&self, map: &OccupancyGrid, p: Point2, reach: f64) -> Self {
        let (column, row) = map.grid_from_map(p);
        let cells = reach / map.resolution();
        let is_near =
            |(c, r): (usize, usize)| (c as f64 - column).abs() <= cells && (r as f64 - row).abs() <= cells;
        let near = self.places(map).filter(|place| is_near(*place));
        Self(near.map(|(column, row)| map.index(column, row) as u32).collect())
    }

    /// Whether there are none.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}
