//! A floor plan drawn with polygons, and its grid with exact cell counts.

use anyhow::{Context, ensure};
use curionav_crowdsim::scenario::contains;
use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::{DistanceField, OccupancyGrid};

/// Unknown cells around the drawing, metres: room for the walls.
const MARGIN_M: f64 = 1.2;
const FREE: i8 = 0;
const OCCUPIED: i8 = 100;
const UNKNOWN: i8 = -1;

/// Corners of a simple polygon, metres, either orientation.
pub(crate) type Polygon = Vec<Point2>;

/// A floor plan: what is floor, what is solid, and where its edge is wall or open.
///
/// Open edges border on unknown space: the robot may not cross them and the laser sees nothing there,
/// like a glass front or a part of a hall that is not mapped.
#[derive(Debug, Clone, Default)]
pub(crate) struct Layout {
    pub outline: Polygon,
    /// Where floor ends inside one of these, it ends at a wall; elsewhere the edge is open.
    pub masonry: Vec<Polygon>,
    pub furniture: Vec<Polygon>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Counts {
    pub known: usize,
    pub occupied: usize,
}

impl Layout {
    /// The grid of this plan. With `counts`, the open west edge recedes and the walls get thicker until
    /// both counts are exact; without, walls are two cells thick.
    pub(crate) fn grid(&self, cell: f64, counts: Option<Counts>) -> anyhow::Result<OccupancyGrid> {
        let (least, most) = bounds(&self.outline);
        let cells_along = |length: f64| (length / cell).ceil() as usize;
        let width = cells_along(most.x - least.x + 2.0 * MARGIN_M);
        let height = cells_along(most.y - least.y + 2.0 * MARGIN_M);
        let origin = Pose2::new(least.x - MARGIN_M, least.y - MARGIN_M, 0.0);
        let blank = OccupancyGrid::new(width, height, cell, origin, vec![UNKNOWN; width * height])?;
        let mut canvas = Canvas { cells: blank.cells().to_vec(), grid: blank };
        canvas.fill(&self.outline, FREE);
        for thing in &self.furniture {
            canvas.fill(thing, OCCUPIED);
        }
        if let Some(counts) = counts {
            canvas.recede_from_west(counts.known.saturating_sub(counts.occupied))?;
        }
        let walls = canvas.wall_cells(&self.masonry);
        let wanted = match counts {
            Some(counts) => counts.occupied.checked_sub(canvas.count(OCCUPIED)).unwrap_or(usize::MAX),
            None => walls.iter().take_while(|(distance, _)| *distance <= 2.0 * cell as f32).count(),
        };
        ensure!(wanted <= walls.len(), "{wanted} wall cells are wanted, and there are {}", walls.len());
        for &(_, index) in &walls[..wanted] {
            canvas.cells[index] = OCCUPIED;
        }
        Ok(OccupancyGrid::new(width, height, cell, origin, canvas.cells)?)
    }
}

/// Cells in the making, on the geometry of `grid`.
struct Canvas {
    grid: OccupancyGrid,
    cells: Vec<i8>,
}

impl Canvas {
    fn fill(&mut self, polygon: &Polygon, value: i8) {
        for index in 0..self.cells.len() {
            if contains(polygon, self.centre(index)) {
                self.cells[index] = value;
            }
        }
    }

    fn centre(&self, index: usize) -> Point2 {
        self.grid.centre(index % self.grid.width(), index / self.grid.width())
    }

    fn count(&self, value: i8) -> usize {
        self.cells.iter().filter(|&&c| c == value).count()
    }

    /// Makes the westmost free cells unknown, column by column, until `wanted` are left.
    fn recede_from_west(&mut self, wanted: usize) -> anyhow::Result<()> {
        let found = self.count(FREE);
        let mut surplus = found
            .checked_sub(wanted)
            .with_context(|| format!("{wanted} free cells are wanted, and there are {found}"))?;
        for column in 0..self.grid.width() {
            for row in 0..self.grid.height() {
                let index = self.grid.index(column, row);
                if surplus > 0 && self.cells[index] == FREE {
                    self.cells[index] = UNKNOWN;
                    surplus -= 1;
                }
            }
        }
        Ok(())
    }

    /// Cells that may become wall, nearest to the floor first: (distance, index).
    fn wall_cells(&self, masonry: &[Polygon]) -> Vec<(f32, usize)> {
        let to_floor = DistanceField::to(&self.grid, |i| self.cells[i] != UNKNOWN);
        let mut walls: Vec<(f32, usize)> = (0..self.cells.len())
            .filter(|&i| self.cells[i] == UNKNOWN && masonry.iter().any(|m| contains(m, self.centre(i))))
            .map(|i| (to_floor.metres()[i], i))
            .collect();
        walls.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        walls
    }
}

/// The corners of the upright rectangle around a polygon.
pub(crate) fn bounds(polygon: &[Point2]) -> (Point2, Point2) {
    polygon.iter().fold(
        (Point2::new(f64::INFINITY, f64::INFINITY), Point2::new(f64::NEG_INFINITY, f64::NEG_INFINITY)),
        |(least, most), p| {
            (Point2::new(least.x.min(p.x), least.y.min(p.y)), Point2::new(most.x.max(p.x), most.y.max(p.y)))
        },
    )
}

#[cfg(test)]
mod tests {
    use curionav_planning::occupancy::Cell;

    use super::*;

    fn rectangle(x0: f64, y0: f64, x1: f64, y1: f64) -> Polygon {
        [(x0, y0), (x1, y0), (x1, y1), (x0, y1)].map(|(x, y)| Point2::new(x, y)).to_vec()
    }

    fn room() -> Layout {
        Layout {
            outline: rectangle(0.0, 0.0, 10.0, 5.0),
            masonry: vec![rectangle(5.0, -1.0, 11.0, 6.0)],
            furniture: vec![rectangle(6.0, 2.0, 7.0, 3.0)],
        }
    }

    fn count(grid: &OccupancyGrid, what: Cell) -> usize {
        (0..grid.cells().len()).filter(|&i| grid.cell(i) == what).count()
    }

    #[test]
    fn counts_are_exact() {
        // floor 50 m2 = 5000 cells, of which 100 are furniture
        let grid = room().grid(0.1, Some(Counts { known: 5203, occupied: 417 })).unwrap();
        assert_eq!((count(&grid, Cell::Occupied), count(&grid, Cell::Free)), (417, 4786));
    }

    #[test]
    fn only_masonry_edges_become_walls() {
        let grid = room().grid(0.1, None).unwrap();
        assert_eq!(grid.at(Point2::new(10.05, 2.5)), Cell::Occupied);
        assert_eq!(grid.at(Point2::new(7.5, 5.15)), Cell::Occupied);
        assert_eq!(grid.at(Point2::new(-0.05, 2.5)), Cell::Unknown);
        assert_eq!(grid.at(Point2::new(2.5, 5.05)), Cell::Unknown);
    }

    #[test]
    fn counts_out_of_reach_are_refused() {
        for counts in [Counts { known: 9000, occupied: 200 }, Counts { known: 500, occupied: 50 }] {
            assert!(room().grid(0.1, Some(counts)).is_err());
        }
    }
}
