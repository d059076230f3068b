//! Shortest way to the goal for a robot of some radius: the fast marching method (Sethian, 1996).

mod lookup;

use std::cmp::Reverse;
use std::collections::BinaryHeap;
use std::sync::Arc;

use crate::geometry::Point2;
use crate::occupancy::{Cell, OccupancyGrid, StaticMap};

/// Geodesic distance to the goal, metres, for every cell from which the goal can be reached.
///
/// Cells nearer to an obstacle than the robot's radius are passable at [`Self::TIGHT_SLOWNESS`] times
/// the cost, so that a robot whose estimate lies a little inside a wall's margin still knows its way
/// out. Cells that are not free stay unreachable (infinite), apart from a ring of two cells that
/// takes its neighbours' values so that interpolation near walls stays finite.
#[derive(Debug, Clone)]
pub struct GeodesicField {
    grid: Arc<OccupancyGrid>,
    metres: Vec<f32>,
}

impl GeodesicField {
    /// Cost factor of cells closer to an obstacle than the robot's radius.
    pub const TIGHT_SLOWNESS: f64 = 6.0;
    /// Cost factor right at the robot's radius, falling to 1 over [`Self::COMFORT`] metres, so that
    /// the shortest way does not scrape along walls.
    pub const WALL_SLOWNESS: f64 = 1.5;
    /// See [`Self::WALL_SLOWNESS`], metres.
    pub const COMFORT: f64 = 0.3;

    /// Room that the shortest way of a planner keeps from walls beyond the robot's radius, metres: what candidates
    /// must keep, and a cell's diagonal.
    pub const PLANNING_MARGIN: f64 = 0.15;

    /// Marches from `goal` over `map`, for a robot of `radius` metres.
    pub fn new(map: &StaticMap, goal: Point2, radius: f64) -> Self {
        let (grid, clearance) = (&map.grid, &map.to_obstacle);
        let (width, height) = (grid.width(), grid.height());
        let slowness: Vec<f32> = (0..width * height)
            .map(|i| {
                if grid.cell(i) != Cell::Free {
                    return f32::INFINITY;
                }
                let margin = clearance.cell(i) - radius;
                let factor = if margin < 0.0 {
                    Self::TIGHT_SLOWNESS
                } else {
                    1.0 + (Self::WALL_SLOWNESS - 1.0) * (1.0 - margin / Self::COMFORT).max(0.0)
                };
                (factor * grid.resolution()) as f32
            })
            .collect();
        let mut metres = vec![f32::INFINITY; width * height];
        let mut done = vec![false; width * height];
        // The front, nearest first: the bits of numbers that are not negative are in their order.
        let mut heap = BinaryHeap::new();
        if let Some((column, row)) = grid.locate(goal) {
            // Exact Euclidean values next to the goal: the march has its greatest error there.
            for (c, r) in grid.around(column, row, 3) {
                let index = grid.index(c, r);
                if slowness[index].is_finite() {
                    metres[index] = grid.centre(c, r).distance(goal) as f32;
                    heap.push(Reverse((metres[index].to_bits(), index)));
                }
            }
        }
        while let Some(Reverse((distance, index))) = heap.pop() {
            if done[index] || f32::from_bits(distance) > metres[index] {
                continue;
            }
            done[index] = true;
            for next in grid.neighbours(index) {
                if done[next] || slowness[next].is_infinite() {
                    continue;
                }
                let candidate = eikonal(&metres, &done, next, width, height, slowness[next]);
                if candidate < metres[next] {
                    metres[next] = candidate;
                    heap.push(Reverse((candidate.to_bits(), next)));
                }
            }
        }
        let mut field = Self { grid: Arc::clone(grid), metres };
        field.grow_rim();
        field.grow_rim();
        field
    }

    /// Gives unreachable cells beside reachable ones a value one metre per cell above the least neighbour,
    /// which keeps interpolation finite at walls and points away from them.
    fn grow_rim(&mut self) {
        let (width, height) = self.size();
        let before = self.metres.clone();
        for row in 0..height {
            for column in 0..width {
                let index = row * width + column;
                if before[index].is_finite() {
                    continue;
                }
                let around = self.grid.around(column, row, 1).map(|(c, r)| before[r * width + c]);
                self.metres[index] = around.fold(f32::INFINITY, f32::min) + 1.0;
            }
        }
    }

    /// Distance to go from a point, metres, bilinear between cell centres; infinite where the goal
    /// cannot be reached or outside the grid.
    pub fn at(&self, p: Point2) -> f64 {
        let (width, height) = self.size();
        let (c, r) = self.grid.grid_from_map(p);
        let (c, r) = (c - 0.5, r - 0.5);
        if c < -0.5 || r < -0.5 || c > width as f64 - 0.5 || r > height as f64 - 0.5 {
            return f64::INFINITY;
        }
        let c = c.clamp(0.0, (width - 1) as f64);
        let r = r.clamp(0.0, (height - 1) as f64);
        let (c0, r0) = (c as usize, r as usize);
        let (c1, r1) = ((c0 + 1).min(width - 1), (r0 + 1).min(height - 1));
        let (fc, fr) = (c - c0 as f64, r - r0 as f64);
        let v = |c: usize, r: usize| f64::from(self.metres[r * width + c]);
        let (a, b, d, e) = (v(c0, r0), v(c1, r0), v(c0, r1), v(c1, r1));
        if a.is_infinite() || b.is_infinite() || d.is_infinite() || e.is_infinite() {
            return a.min(b).min(d).min(e);
        }
        (a * (1.0 - fc) + b * fc) * (1.0 - fr) + (d * (1.0 - fc) + e * fc) * fr
    }

    fn size(&self) -> (usize, usize) {
        (self.grid.width(), self.grid.height())
    }

    /// Shortest way from `start`, a point every `spacing` metres, by steepest descent; empty when the
    /// goal cannot be reached.
    pub fn descend(&self, start: Point2, spacing: f64) -> Vec<Point2> {
        self.descend_for(start, spacing, f64::INFINITY)
    }

    /// The first `length` metres of [`Self::descend`].
    pub fn descend_for(&self, start: Point2, spacing: f64, length: f64) -> Vec<Point2> {
        let mut path = vec![start];
        let mut p = start;
        let whole = self.at(start);
        if !whole.is_finite() {
            return Vec::new();
        }
        let limit = ((4.0 * whole / spacing) as usize + 16).min((length / spacing).ceil() as usize);
        for _ in 0..limit {
            let here = self.at(p);
            if here <= spacing {
                break;
            }
            // 32 directions: robust where the gradient is not (ridges, rims).
            let best = (0..32)
                .map(|k| {
                    let (s, c) = crate::numerics::sin_cos(f64::from(k) * std::f64::consts::TAU / 32.0);
                    Point2::new(p.x + spacing * c, p.y + spacing * s)
                })
                .min_by(|a, b| self.at(*a).total_cmp(&self.at(*b)));
            match best {
                Some(next) if self.at(next) < here => p = next,
                _ => break,
            }
            path.push(p);
        }
        path
    }
}

/// First-order upwind solution of |grad T| = slowness at one cell.
fn eikonal(metres: &[f32], done: &[bool], index: usize, width: usize, height: usize, slowness: f32) -> f32 {
    let (column, row) = (index % width, index / width);
    let value = |i: usize| if done[i] { metres[i] } else { f32::INFINITY };
    let left = if column > 0 { value(index - 1) } else { f32::INFINITY };
    let right = if column + 1 < width { value(index + 1) } else { f32::INFINITY };
    let below = if row > 0 { value(index - width) } else { f32::INFINITY };
    let above = if row + 1 < height { value(index + width) } else { f32::INFINITY };
    let (a, b) = (left.min(right), below.min(above));
    let difference = (a - b).abs();
    if difference >= slowness || !difference.is_finite() {
        a.min(b) + slowness
    } else {
        0.5 * (a + b + (2.0 * slowness * slowness - difference * difference).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;

    #[test]
    fn open_space_is_euclidean_within_two_percent() {
        let grid = OccupancyGrid::new(200, 200, 0.1, Pose2::default(), vec![0; 40_000]).unwrap();
        let goal = Point2::new(10.0, 10.0);
        let field = GeodesicField::new(&StaticMap::new(grid), goal, 0.3);
        for p in [Point2::new(3.0, 10.0), Point2::new(5.0, 5.0), Point2::new(17.0, 13.0)] {
            let expected = p.distance(goal);
            assert!((field.at(p) / expected - 1.0).abs() < 0.02, "{p:?}: {} vs {expected}", field.at(p));
        }
    }

    #[test]
    fn a_wall_is_gone_around_and_a_sealed_room_is_unreachable() {
        // 10 m x 10 m, wall at x = 5 from y = 0 to y = 8; a sealed box around (9, 1).
        let mut cells = vec![0_i8; 10_000];
        for row in 0..80 {
            cells[row * 100 + 50] = 100;
        }
        for k in 0..21 {
            cells[20 * 100 + 79 + k.min(20)] = 100;
            cells[k * 100 + 79] = 100;
        }
        let grid = OccupancyGrid::new(100, 100, 0.1, Pose2::default(), cells).unwrap();
        let field = GeodesicField::new(&StaticMap::new(grid), Point2::new(2.0, 2.0), 0.3);
        // by way of the wall's end at (5, 8): about 6.7 + 6.7
        let around = field.at(Point2::new(8.0, 2.5));
        assert!(around > 12.0 && around < 16.0, "{around}");
        assert!(field.at(Point2::new(9.0, 1.0)).is_infinite());
        let path = field.descend(Point2::new(8.0, 2.5), 0.2);
        assert!(path.last().unwrap().distance(Point2::new(2.0, 2.0)) < 0.4);
    }
}
