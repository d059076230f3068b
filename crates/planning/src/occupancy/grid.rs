//! The occupancy grid.

use std::sync::Arc;

use sha2::{Digest, Sha256};

use crate::geometry::{Point2, Pose2};
use crate::numerics::sin_cos;

/// Largest number of cells a map may have: 16 million is 200 m x 200 m at 5 cm.
pub const MAX_CELLS: usize = 16_000_000;

/// What a cell holds, after thresholds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cell {
    /// Known and passable.
    Free,
    /// Known and solid: a landmark in the paper's words.
    Occupied,
    /// Never observed, or in between the thresholds.
    Unknown,
}

/// What is wrong with numbers that were to become a grid.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum GridError {
    /// So many cells do not fill a rectangle of these columns and rows, or it is empty or too large.
    #[error("a map of {0} x {1} needs {expected} cells, at least one and at most {MAX_CELLS}; found {2}", expected = .0 * .1)]
    Size(usize, usize, usize),
    /// The resolution is not a positive finite number, or the origin is not finite.
    #[error("resolution must be positive and the origin finite (resolution {0}, origin {1:?})")]
    Geometry(f64, Pose2),
    /// A limit of speed is more than all of it, per cent.
    #[error("a limit of speed is 0 to 100 per cent, found {0}")]
    Limit(u8),
}

/// A grid of occupancy values, row 0 at the bottom (least y), as in `nav_msgs/OccupancyGrid`.
///
/// A cell's value is -1 for unknown or the occupancy in percent, 0 to 100. The lower-left corner of
/// cell (0, 0) is at `origin`; the grid's axes are turned by `origin.heading`.
#[derive(Debug, Clone, PartialEq)]
pub struct OccupancyGrid {
    width: usize,
    height: usize,
    resolution: f64,
    origin: Pose2,
    /// Sine and cosine of the origin's heading: every look-up needs them.
    turn: (f64, f64),
    cells: Vec<i8>,
    /// What zones allow; empty without zones.
    limits: Arc<[u8]>,
    hash: [u8; 32],
}

impl OccupancyGrid {
    /// Values from this on are [`Cell::Occupied`], percent (map_server's 0.65).
    pub const OCCUPIED_FROM: i8 = 65;
    /// Values up to this are [`Cell::Free`], percent (map_server's 0.196, up to 0.25 in later maps).
    pub const FREE_UP_TO: i8 = 25;
    /// A limit of speed that limits nothing, per cent.
    pub const NO_LIMIT: u8 = 100;

    /// Checks the shape and computes the hash. `cells` is row-major from the bottom row.
    pub fn new(
        width: usize,
        height: usize,
        resolution: f64,
        origin: Pose2,
        cells: Vec<i8>,
    ) -> Result<Self, GridError> {
        let expected = width.checked_mul(height).unwrap_or(0);
        if expected == 0 || expected > MAX_CELLS || cells.len() != expected {
            return Err(GridError::Size(width, height, cells.len()));
        }
        let finite = origin.x.is_finite() && origin.y.is_finite() && origin.heading.is_finite();
        if !(resolution > 0.0 && resolution.is_finite() && finite) {
            return Err(GridError::Geometry(resolution, origin));
        }
        let turn = sin_cos(origin.heading);
        let limits = Arc::default();
        Ok(Self { width, height, resolution, origin, turn, cells, limits, hash: [0; 32] }.hashed())
    }

    /// The same grid with zones: for each cell the share of its greatest speed that a robot may drive with there, per
    /// cent. At 0 it must not drive there: that is keepout. None, or 100 everywhere, means no zones.
    ///
    /// # Errors
    /// There is not one for each cell, or one of them is above 100.
    pub fn with_limits(&self, limits: Vec<u8>) -> Result<Self, GridError> {
        if !(limits.is_empty() || limits.len() == self.cells.len()) {
            return Err(GridError::Size(self.width, self.height, limits.len()));
        }
        if let Some(limit) = limits.iter().find(|limit| **limit > Self::NO_LIMIT) {
            return Err(GridError::Limit(*limit));
        }
        let is_limited = limits.iter().any(|limit| *limit < Self::NO_LIMIT);
        let limits = if is_limited { limits.into() } else { Arc::default() };
        Ok(Self { limits, ..self.clone() }.hashed())
    }

    /// The same grid, with each cell as `change` makes it from its index and its value.
    #[must_use]
    pub fn changed(&self, change: impl Fn(usize, i8) -> i8) -> Self {
        let cells = self.cells.iter().enumerate().map(|(index, cell)| change(index, *cell)).collect();
        Self { cells, limits: Arc::clone(&self.limits), ..*self }.hashed()
    }

    /// The geometry of this grid with so many cells joined along either axis, and nothing in it. The last column and
    /// row may reach beyond.
    pub(crate) fn joined(&self, cells: usize) -> Self {
        let width = self.width.div_ceil(cells);
        let height = self.height.div_ceil(cells);
        let resolution = self.resolution * cells as f64;
        let cells = vec![0; width * height];
        Self { width, height, resolution, cells, limits: Arc::default(), hash: [0; 32], ..*self }
    }

    fn hashed(self) -> Self {
        let Self { width, height, resolution, origin, ref cells, ref limits, .. } = self;
        let mut digest = Sha256::new();
        digest.update((width as u64).to_le_bytes());
        digest.update((height as u64).to_le_bytes());
        for number in [resolution, origin.x, origin.y, origin.heading] {
            digest.update(number.to_le_bytes());
        }
        digest.update(cells.iter().map(|&c| c as u8).collect::<Vec<u8>>());
        digest.update(limits);
        Self { hash: digest.finalize().into(), ..self }
    }

    /// Columns.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Rows.
    pub fn height(&self) -> usize {
        self.height
    }

    /// Metres per cell.
    pub fn resolution(&self) -> f64 {
        self.resolution
    }

    /// Pose of the lower-left corner in the map frame.
    pub fn origin(&self) -> Pose2 {
        self.origin
    }

    /// Sine and cosine of the heading of the grid's axes.
    pub(crate) fn turn(&self) -> (f64, f64) {
        self.turn
    }

    /// Raw values, row-major from the bottom row.
    pub fn cells(&self) -> &[i8] {
        &self.cells
    }

    /// What zones allow in each cell, per cent of a robot's greatest speed; empty without zones.
    pub fn limits(&self) -> &[u8] {
        &self.limits
    }

    /// What a zone allows in the cell at `index`, per cent of a robot's greatest speed: 0 is keepout.
    pub fn limit(&self, index: usize) -> u8 {
        self.limits.get(index).copied().unwrap_or(Self::NO_LIMIT)
    }

    /// Identity of the map: SHA-256 over its geometry and cells, and over its zones if it has any.
    pub fn hash(&self) -> [u8; 32] {
        self.hash
    }

    /// Index into [`Self::cells`].
    pub fn index(&self, column: usize, row: usize) -> usize {
        row * self.width + column
    }

    /// What the cell at `index` holds.
    pub fn cell(&self, index: usize) -> Cell {
        match self.cells[index] {
            c if c >= Self::OCCUPIED_FROM => Cell::Occupied,
            0..=Self::FREE_UP_TO => Cell::Free,
            _ => Cell::Unknown,
        }
    }

    /// Whether a robot may be in the cell at `index`: it is free, and in no keepout zone.
    pub fn is_drivable(&self, index: usize) -> bool {
        self.cell(index) == Cell::Free && self.limit(index) > 0
    }

    /// Indices of the cells that share a side with the one at `index`.
    pub fn neighbours(&self, index: usize) -> impl Iterator<Item = usize> + use<> {
        let column = index % self.width;
        let row = index / self.width;
        let beside = [
            (column > 0).then(|| index - 1),
            (column + 1 < self.width).then(|| index + 1),
            (row > 0).then(|| index - self.width),
            (row + 1 < self.height).then(|| index + self.width),
        ];
        beside.into_iter().flatten()
    }

    /// Column and row of every cell at most `reach` cells from (column, row) along both axes, row by row.
    pub fn around(&self, column: usize, row: usize, reach: usize) -> impl Iterator<Item = (usize, usize)> {
        let span = |at: usize, end: usize| at.saturating_sub(reach)..(at + reach + 1).min(end);
        let columns = span(column, self.width);
        span(row, self.height).flat_map(move |r| columns.clone().map(move |c| (c, r)))
    }

    /// Continuous cell coordinates (column, row) of a point of the map frame: cell (i, j) covers
    /// [i, i+1) x [j, j+1). May lie outside the grid.
    pub fn grid_from_map(&self, p: Point2) -> (f64, f64) {
        let q = self.from_corner(p);
        (q.x / self.resolution, q.y / self.resolution)
    }

    /// A point of the map frame in the grid's axes, metres from its lower-left corner.
    pub fn from_corner(&self, p: Point2) -> Point2 {
        let (s, c) = self.turn;
        let dx = p.x - self.origin.x;
        let dy = p.y - self.origin.y;
        Point2::new(c * dx + s * dy, -s * dx + c * dy)
    }

    /// The point of the map frame at the continuous cell coordinates (column, row).
    pub fn map_from_grid(&self, column: f64, row: f64) -> Point2 {
        let (s, c) = self.turn;
        let x = column * self.resolution;
        let y = row * self.resolution;
        Point2::new(self.origin.x + c * x - s * y, self.origin.y + s * x + c * y)
    }

    /// Map-frame centre of cell (column, row).
    pub fn centre(&self, column: usize, row: usize) -> Point2 {
        self.map_from_grid(column as f64 + 0.5, row as f64 + 0.5)
    }

    /// (column, row) of the cell that holds the point, if inside.
    pub fn locate(&self, p: Point2) -> Option<(usize, usize)> {
        let (c, r) = self.grid_from_map(p);
        (c >= 0.0 && r >= 0.0 && c < self.width as f64 && r < self.height as f64)
            .then_some((c as usize, r as usize))
    }

    /// Distance from a point to the grid's edge, metres; negative outside.
    pub fn to_edge(&self, p: Point2) -> f64 {
        let (column, row) = self.grid_from_map(p);
        let across = column.min(self.width as f64 - column);
        across.min(row).min(self.height as f64 - row) * self.resolution
    }

    /// Whether a robot may be at the point: see [`Self::is_drivable`]. It may not outside.
    pub fn is_drivable_at(&self, p: Point2) -> bool {
        self.locate(p).is_some_and(|(c, r)| self.is_drivable(self.index(c, r)))
    }

    /// What lies at the point; unknown outside.
    pub fn at(&self, p: Point2) -> Cell {
        self.locate(p).map_or(Cell::Unknown, |(c, r)| self.cell(self.index(c, r)))
    }
}
