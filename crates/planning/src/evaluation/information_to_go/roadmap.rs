//! Places all over a map, a few tenths of a metre from each other, and which of them a robot can drive between.

use crate::geometry::Point2;
use crate::occupancy::{OccupancyGrid, StaticMap};

/// Least distance between places, metres.
const SPACING: f64 = 0.4;
/// Most places: on a larger map they are farther apart.
const MOST: f64 = 20_000.0;

/// One place per square block of cells, where the block has one: its cell with the most room.
#[derive(Debug, Clone)]
pub(super) struct Roadmap {
    /// Cells along a block's side.
    side: usize,
    /// Metres along a block's side.
    pub(super) spacing: f64,
    pub(super) columns: usize,
    pub(super) rows: usize,
    /// Where the place of each block is, map frame.
    places: Vec<Option<Point2>>,
}

/// A neighbour of a place.
pub(super) struct Edge {
    pub(super) to: usize,
    pub(super) metres: f32,
    /// Whether the blocks of the two places touch at a corner alone.
    pub(super) diagonal: bool,
}

impl Roadmap {
    /// The places at which a robot of `radius` metres touches no wall.
    pub(super) fn new(map: &StaticMap, radius: f64) -> Self {
        let grid = &*map.grid;
        let cells = grid.cells().len() as f64;
        let least = SPACING / grid.resolution();
        let side = least.max((cells / MOST).sqrt()).ceil().max(1.0) as usize;
        let columns = grid.width().div_ceil(side);
        let rows = grid.height().div_ceil(side);
        let place = |block: usize| {
            let column = block % columns * side;
            let row = block / columns * side;
            let cells = (row..(row + side).min(grid.height()))
                .flat_map(|r| (column..(column + side).min(grid.width())).map(move |c| (c, r)));
            let rooms = cells.filter_map(|(c, r)| {
                let index = grid.index(c, r);
                let room = map.to_obstacle.cell(index);
                (grid.is_drivable(index) && room >= radius).then_some((room, (c, r)))
            });
            // Of cells with equal room the first is taken.
            let best = rooms.fold(None, |best: Option<(f64, _)>, next| match best {
                Some(best) if best.0 >= next.0 => Some(best),
                _ => Some(next),
            });
            best.map(|(_, (c, r))| grid.centre(c, r))
        };
        let places = (0..columns * rows).map(place).collect();
        Self { side, spacing: side as f64 * grid.resolution(), columns, rows, places }
    }

    /// What it takes in memory, bytes.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.places[..])
    }

    /// Blocks, with a place or without.
    pub(super) fn len(&self) -> usize {
        self.places.len()
    }

    /// Where the place of a block is, map frame.
    pub(super) fn place(&self, block: usize) -> Option<Point2> {
        self.places[block]
    }

    /// Column and row of a point among the centres of blocks.
    pub(super) fn between(&self, grid: &OccupancyGrid, p: Point2) -> (f64, f64) {
        let (column, row) = grid.grid_from_map(p);
        (column / self.side as f64 - 0.5, row / self.side as f64 - 0.5)
    }

    /// The place nearest to a point, if the point is on the map: where a way begins or ends.
    pub(super) fn nearest(&self, p: Point2) -> Option<usize> {
        let away = |block: &usize| self.places[*block].map_or(f64::INFINITY, |q| q.distance_squared(p));
        (0..self.len()).filter(|b| self.places[*b].is_some()).min_by(|a, b| away(a).total_cmp(&away(b)))
    }

    /// The places beside each place to which the straight way touches no wall.
    pub(super) fn edges(&self, map: &StaticMap, radius: f64) -> Vec<Vec<Edge>> {
        const AHEAD: [(isize, isize); 4] = [(1, 0), (0, 1), (1, 1), (-1, 1)];
        let mut edges: Vec<Vec<Edge>> = (0..self.len()).map(|_| Vec::new()).collect();
        for from in 0..self.len() {
            let Some(p) = self.places[from] else { continue };
            for (right, up) in AHEAD {
                let column = (from % self.columns) as isize + right;
                let row = (from / self.columns) as isize + up;
                if column < 0 || column >= self.columns as isize || row >= self.rows as isize {
                    continue;
                }
                let to = row as usize * self.columns + column as usize;
                let Some(q) = self.places[to] else { continue };
                if is_clear(map, p, q, 0.5 * radius) {
                    let metres = p.distance(q) as f32;
                    let diagonal = right != 0 && up != 0;
                    edges[from].push(Edge { to, metres, diagonal });
                    edges[to].push(Edge { to: from, metres, diagonal });
                }
            }
        }
        edges
    }
}

/// Whether every point between two is at least so many metres from walls.
fn is_clear(map: &StaticMap, from: Point2, to: Point2, room: f64) -> bool {
    let pieces = (from.distance(to) / map.grid.resolution()).ceil().max(1.0);
    (1..pieces as usize).all(|k| {
        let s = k as f64 / pieces;
        let p = Point2::new(from.x + s * (to.x - from.x), from.y + s * (to.y - from.y));
        map.grid.is_drivable_at(p) && map.to_obstacle.at(&map.grid, p) >= room
    })
}
