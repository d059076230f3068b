//! Exact Euclidean distance transform (Felzenszwalb and Huttenlocher, 2012).

use std::ops::Range;

use crate::geometry::Point2;
use crate::numerics::hypot;
use crate::occupancy::{Cell, OccupancyGrid};

/// Distance from each cell's centre to the centre of the nearest cell of some kind, metres.
/// Where there is no such cell, the distance is the grid's diagonal.
#[derive(Debug, Clone, PartialEq)]
pub struct DistanceField {
    width: usize,
    height: usize,
    resolution: f64,
    metres: Vec<f32>,
}

impl DistanceField {
    /// Bytes of memory.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&*self.metres)
    }

    /// Distance to the nearest occupied cell: what laser beams end on.
    pub fn to_occupied(grid: &OccupancyGrid) -> Self {
        Self::to(grid, |i| grid.cell(i) == Cell::Occupied)
    }

    /// Distance to the nearest cell that is not known to be free, or is keepout: what a robot must keep clear of.
    pub fn to_obstacle(grid: &OccupancyGrid) -> Self {
        Self::to(grid, |i| !grid.is_drivable(i))
    }

    /// Distance to the nearest cell of `grid` whose index is a target.
    pub fn to(grid: &OccupancyGrid, is_target: impl Fn(usize) -> bool) -> Self {
        let width = grid.width();
        let height = grid.height();
        let within_columns = within_columns(width, height, is_target);
        let far = (width * width + height * height) as f64;
        let mut envelope = Envelope::new(width);
        let mut metres = Vec::with_capacity(width * height);
        for row in within_columns.chunks_exact(width) {
            let squared = envelope.of(row).iter();
            metres.extend(squared.map(|d| (d.min(far).sqrt() * grid.resolution()) as f32));
        }
        Self { width, height, resolution: grid.resolution(), metres }
    }

    /// How far from targets that are added later distances are exact, metres: farther away no planner asks for room.
    pub const NEAR: f64 = 3.0;

    /// The distances with these cells as targets as well, exact up to [`Self::NEAR`] from them.
    #[must_use]
    pub fn with_targets(&self, targets: &[usize]) -> Self {
        let mut field = self.clone();
        let Some(window) = Window::around(targets, self) else { return field };
        let mut is_target = vec![false; window.width() * window.height()];
        for target in targets {
            is_target[window.local(target % self.width, target / self.width)] = true;
        }
        let within_columns = within_columns(window.width(), window.height(), |i| is_target[i]);
        let mut envelope = Envelope::new(window.width());
        for (row, distances) in within_columns.chunks_exact(window.width()).enumerate() {
            let first = (window.rows.start + row) * self.width + window.columns.start;
            let known = &mut field.metres[first..first + window.width()];
            for (known, squared) in known.iter_mut().zip(envelope.of(distances)) {
                *known = known.min((squared.sqrt() * self.resolution) as f32);
            }
        }
        field
    }

    /// Distance from the centre of the cell with this index, metres.
    pub fn cell(&self, index: usize) -> f64 {
        f64::from(self.metres[index])
    }

    /// Distance from the centre of the cell that holds the point, metres; 0 outside the grid. The point itself may be
    /// nearer: [`Self::clearance`] says how near.
    pub fn at(&self, grid: &OccupancyGrid, p: Point2) -> f64 {
        grid.locate(p).map_or(0.0, |(c, r)| self.cell(r * self.width + c))
    }

    /// Distance at a point, bilinear between the centres of the four cells around it, metres: it grows with
    /// every step away from a wall, not only with every cell. Cells outside the grid count as 0.
    pub fn between_cells(&self, grid: &OccupancyGrid, p: Point2) -> f64 {
        let (u, v) = grid.grid_from_map(p);
        let u = u - 0.5;
        let v = v - 0.5;
        let column = u.floor();
        let row = v.floor();
        let cell = |c: f64, r: f64| {
            let inside = c >= 0.0 && r >= 0.0 && c < self.width as f64 && r < self.height as f64;
            if inside { self.cell(r as usize * self.width + c as usize) } else { 0.0 }
        };
        let along = |r: f64| {
            let a = cell(column, r);
            let b = cell(column + 1.0, r);
            a + (u - column) * (b - a)
        };
        let low = along(row);
        let high = along(row + 1.0);
        low + (v - row) * (high - low)
    }

    /// A lower bound of the distance from the point to the nearest target cell's area, metres, without a look at any
    /// other cell: half a cell's diagonal on either side is given away.
    pub fn least_clearance(&self, grid: &OccupancyGrid, p: Point2) -> f64 {
        (self.at(grid, p) - std::f64::consts::SQRT_2 * self.resolution).max(0.0)
    }

    /// A bound of the distance from the point to the nearest target cell's area, metres: the distance is `enough` or
    /// more exactly where this is. What collision checks compare with a radius.
    pub fn clearance(&self, grid: &OccupancyGrid, p: Point2, enough: f64) -> f64 {
        let centre = self.at(grid, p);
        let least = (centre - std::f64::consts::SQRT_2 * self.resolution).max(0.0);
        // From this cell's centre the point is half a diagonal away, and the nearest target reaches half a cell.
        let most = centre + (std::f64::consts::FRAC_1_SQRT_2 - 0.5 + ROUNDING) * self.resolution;
        if least >= enough {
            least
        } else if most < enough {
            most
        } else {
            self.exact_clearance(grid, p)
        }
    }

    /// Distance from the point to the nearest target cell's area, metres; 0 outside the grid.
    pub fn exact_clearance(&self, grid: &OccupancyGrid, p: Point2) -> f64 {
        let Some((column, row)) = grid.locate(p) else { return 0.0 };
        let (x, y) = grid.grid_from_map(p);
        // In cells. The nearest target's centre lies in a ring, whose width is what the field leaves open.
        let to_centre = self.cell(row * self.width + column) / self.resolution;
        let off = hypot(x - column as f64 - 0.5, y - row as f64 - 0.5);
        let ring =
            to_centre - off - ROUNDING..to_centre + off + std::f64::consts::FRAC_1_SQRT_2 - 0.5 + ROUNDING;
        let mut least = f64::INFINITY;
        for row in within(y, ring.end, self.height) {
            let dy = beside(y, row as f64);
            let to_row = row as f64 + 0.5 - y;
            let widest = across(ring.end, to_row);
            let inside = across(ring.start.max(0.0), to_row);
            let columns = within(x, widest, self.width);
            let before = columns.start..within(x, inside, self.width).start.min(columns.end);
            let behind = within(x, inside, self.width).end.max(before.end)..columns.end;
            for column in before.chain(behind) {
                if self.metres[row * self.width + column] == 0.0 {
                    let dx = beside(x, column as f64);
                    least = least.min(dx * dx + dy * dy);
                }
            }
        }
        // Without any target the field holds the grid's diagonal.
        if least.is_finite() { least.sqrt() * self.resolution } else { self.least_clearance(grid, p) }
    }

    /// All distances, row-major from the bottom row, metres.
    pub fn metres(&self) -> &[f32] {
        &self.metres
    }

    /// Columns and rows.
    pub fn size(&self) -> (usize, usize) {
        (self.width, self.height)
    }
}

/// Cells by which the field's single precision may be off.
const ROUNDING: f64 = 1e-3;

/// How far outside [from, from + 1] a coordinate lies.
fn beside(x: f64, from: f64) -> f64 {
    (from - x).max(x - from - 1.0).max(0.0)
}

/// Half the chord of a circle at this distance from its middle; 0 where there is none.
fn across(radius: f64, distance: f64) -> f64 {
    (radius * radius - distance * distance).max(0.0).sqrt()
}

/// The cells below `count` whose middles are at most `reach` away.
fn within(x: f64, reach: f64, count: usize) -> Range<usize> {
    let first = (x - 0.5 - reach).ceil().max(0.0) as usize;
    let end = ((x - 0.5 + reach).floor() + 1.0).max(0.0) as usize;
    first..end.min(count).max(first)
}

/// A part of a grid.
struct Window {
    columns: Range<usize>,
    rows: Range<usize>,
}

impl Window {
    /// The part in which distances to these cells are at most [`DistanceField::NEAR`]; none without cells.
    fn around(cells: &[usize], field: &DistanceField) -> Option<Self> {
        let DistanceField { width, height, resolution, .. } = *field;
        let reach = (DistanceField::NEAR / resolution).ceil() as usize;
        let columns = cells.iter().map(|cell| cell % width);
        let rows = cells.iter().map(|cell| cell / width);
        Some(Self {
            columns: columns.clone().min()?.saturating_sub(reach)..(columns.max()? + reach + 1).min(width),
            rows: rows.clone().min()?.saturating_sub(reach)..(rows.max()? + reach + 1).min(height),
        })
    }

    fn width(&self) -> usize {
        self.columns.len()
    }

    fn height(&self) -> usize {
        self.rows.len()
    }

    /// Index in the window of a cell of the grid.
    fn local(&self, column: usize, row: usize) -> usize {
        (row - self.rows.start) * self.width() + column - self.columns.start
    }
}

/// Distance from each cell to the nearest target of its column, cells; more than the diagonal where there is none.
/// Row by row in both directions, so that memory is walked in its order.
fn within_columns(width: usize, height: usize, is_target: impl Fn(usize) -> bool) -> Vec<i32> {
    // At most 16 million cells: neither this nor the index of a cell is near the greatest number.
    let none = (width + height) as i32;
    let mut cells: Vec<i32> = (0..width * height).map(|i| if is_target(i) { 0 } else { none }).collect();
    for row in 1..height {
        let (before, rest) = cells.split_at_mut(row * width);
        nearer(&mut rest[..width], &before[(row - 1) * width..]);
    }
    for row in (1..height).rev() {
        let (before, rest) = cells.split_at_mut(row * width);
        nearer(&mut before[(row - 1) * width..], &rest[..width]);
    }
    cells
}

/// A target of the row beside is one cell farther from this row.
fn nearer(row: &mut [i32], beside: &[i32]) {
    for (cell, beside) in row.iter_mut().zip(beside) {
        *cell = (*cell).min(beside + 1);
    }
}

/// Lower envelope of the parabolas over one row.
struct Envelope {
    /// Height of each column's parabola at its vertex.
    lowest: Vec<f64>,
    /// The same at column 0, less what all parabolas have in common there.
    risen: Vec<f64>,
    vertex: Vec<usize>,
    boundary: Vec<f64>,
    squared: Vec<f64>,
}

impl Envelope {
    fn new(width: usize) -> Self {
        let zeros = || vec![0.0; width];
        Self {
            lowest: zeros(),
            risen: zeros(),
            vertex: vec![0; width],
            boundary: vec![0.0; width + 1],
            squared: zeros(),
        }
    }

    /// The least of `row[j]^2 + (i - j)^2` over all j, for every i. All numbers are whole but for the boundaries, and
    /// these differ from a whole number by nothing or by far more than their rounding, so the result is exact.
    fn of(&mut self, row: &[i32]) -> &[f64] {
        for (q, &cells) in row.iter().enumerate() {
            self.lowest[q] = f64::from(cells) * f64::from(cells);
            self.risen[q] = self.lowest[q] + (q * q) as f64;
        }
        let risen = &self.risen;
        let crossing = |q: usize, p: usize| (risen[q] - risen[p]) / (2 * (q - p)) as f64;
        let mut top = 0;
        self.vertex[0] = 0;
        self.boundary[0] = f64::NEG_INFINITY;
        for q in 1..row.len() {
            let mut s = crossing(q, self.vertex[top]);
            while s <= self.boundary[top] {
                top -= 1;
                s = crossing(q, self.vertex[top]);
            }
            top += 1;
            self.vertex[top] = q;
            self.boundary[top] = s;
        }
        let mut k = 0;
        for (i, squared) in self.squared.iter_mut().enumerate() {
            while k < top && self.boundary[k + 1] < i as f64 {
                k += 1;
            }
            let d = i as f64 - self.vertex[k] as f64;
            *squared = self.lowest[self.vertex[k]] + d * d;
        }
        &self.squared
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use crate::random::{rng, uniform};

    #[test]
    fn targets_that_are_added_later_count_as_if_they_had_been_there() {
        for seed in 0..20 {
            let mut r = rng(seed, 1);
            let width = 60 + (uniform(&mut r) * 60.0) as usize;
            let cells = (0..width * 80).map(|_| if uniform(&mut r) < 0.002 { 100 } else { 0 }).collect();
            let grid = OccupancyGrid::new(width, 80, 0.1, Pose2::default(), cells).unwrap();
            let corner = (uniform(&mut r) * 40.0) as usize;
            let place = |r: &mut _| corner + (uniform(r) * 20.0) as usize;
            let added: Vec<usize> = (0..8).map(|_| place(&mut r) * width + place(&mut r)).collect();
            let found = DistanceField::to_occupied(&grid).with_targets(&added);
            let whole = DistanceField::to(&grid, |i| grid.cell(i) == Cell::Occupied || added.contains(&i));
            for i in 0..width * 80 {
                let expected = whole.cell(i);
                let is_near = expected <= DistanceField::NEAR;
                assert!(
                    if is_near { found.cell(i) == expected } else { found.cell(i) >= expected },
                    "{seed}, {i}"
                );
            }
        }
        let grid = OccupancyGrid::new(3, 3, 0.1, Pose2::default(), vec![0; 9]).unwrap();
        let empty = DistanceField::to_occupied(&grid);
        assert_eq!(empty.with_targets(&[]), empty);
    }

    #[test]
    fn equals_brute_force_on_random_grids() {
        for seed in 0..20 {
            let mut r = rng(seed, 0);
            let w = 3 + (uniform(&mut r) * 30.0) as usize;
            let h = 3 + (uniform(&mut r) * 30.0) as usize;
            let share = 0.3 * uniform(&mut r);
            let cells: Vec<i8> = (0..w * h).map(|_| if uniform(&mut r) < share { 100 } else { 0 }).collect();
            let grid = OccupancyGrid::new(w, h, 0.1, Pose2::default(), cells).unwrap();
            let field = DistanceField::to_occupied(&grid);
            let diagonal = ((w * w + h * h) as f64).sqrt() * 0.1;
            for i in 0..w * h {
                let cx = (i % w) as f64;
                let cy = (i / w) as f64;
                let nearest = (0..w * h)
                    .filter(|&j| grid.cell(j) == Cell::Occupied)
                    .map(|j| ((cx - (j % w) as f64).powi(2) + (cy - (j / w) as f64).powi(2)).sqrt() * 0.1)
                    .fold(diagonal, f64::min);
                assert!((field.cell(i) - nearest).abs() < 1e-5, "seed {seed} cell {i}");
            }
        }
    }

    #[test]
    fn between_cells_distances_grow_evenly_away_from_a_wall() {
        let cells = (0..100).map(|i| if i % 10 == 0 { 100 } else { 0 }).collect();
        let grid = OccupancyGrid::new(10, 10, 0.2, Pose2::new(1.0, 2.0, 0.0), cells).unwrap();
        let field = DistanceField::to_obstacle(&grid);
        for k in 0..80 {
            // The wall's centres are at 1.1.
            let x = 1.1 + 0.02 * f64::from(k);
            let found = field.between_cells(&grid, Point2::new(x, 3.03));
            assert!((found - (x - 1.1)).abs() < 1e-6, "{x}: {found}");
        }
        assert_eq!(field.between_cells(&grid, Point2::new(-5.0, 3.0)), 0.0);
    }
}
