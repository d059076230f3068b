//! Where the walls of a map begin: beams end on surfaces.

use curionav_planning::geometry::{Direction, Point2};
use curionav_planning::occupancy::{Cell, DistanceField, StaticMap};

/// Distances to surfaces, for every cell.
pub(crate) struct Surfaces {
    pub(crate) map: StaticMap,
    /// Distance from each cell's centre to the nearest surface, metres, negative inside of what is solid: the side
    /// between an occupied cell and one that is not lies half a cell before either's centre.
    pub(crate) metres: Vec<f32>,
    /// Of the grid's first axis on the map.
    axis: Direction,
}

impl Surfaces {
    pub(crate) fn new(map: &StaticMap) -> Self {
        let half = (0.5 * map.grid.resolution()) as f32;
        let inside = DistanceField::to(&map.grid, |i| map.grid.cell(i) != Cell::Occupied);
        let both = map.to_occupied.metres().iter().zip(inside.metres());
        let metres = both.map(|(out, inside)| if *out > 0.0 { out - half } else { half - inside }).collect();
        Self { map: map.clone(), metres, axis: Direction::of(map.grid.origin().heading) }
    }

    /// Distance to the nearest surface and how it grows along both axes of the map, between the centres of cells; none
    /// off the map.
    pub(crate) fn at(&self, p: Point2) -> Option<(f64, Point2)> {
        let grid = &self.map.grid;
        let (column, row) = grid.grid_from_map(p);
        let column = column - 0.5;
        let row = row - 0.5;
        let width = grid.width();
        let is_inside =
            column >= 0.0 && row >= 0.0 && column < (width - 1) as f64 && row < (grid.height() - 1) as f64;
        if !is_inside {
            return None;
        }
        let first = row as usize * width + column as usize;
        let right = column - column.floor();
        let up = row - row.floor();
        let a = f64::from(self.metres[first]);
        let b = f64::from(self.metres[first + 1]);
        let c = f64::from(self.metres[first + width]);
        let d = f64::from(self.metres[first + width + 1]);
        let low = a + right * (b - a);
        let high = c + right * (d - c);
        let across = ((b - a) + up * ((d - c) - (b - a))) / grid.resolution();
        let along = (high - low) / grid.resolution();
        // From the grid's axes to those of the map.
        let Direction { cos, sin } = self.axis;
        let slope = Point2::new(cos * across - sin * along, sin * across + cos * along);
        Some((low + up * (high - low), slope))
    }
}
