//! Shortest way to the goal for a robot of some radius: the fast marching method (Sethian, 1996).

pub(super) mod coarse;
pub(super) mod detour;
mod joined;
mod lookup;

use std::ops::Range;
use std::sync::Arc;

use crate::geometry::Point2;
use crate::numerics::sin_cos;
use crate::occupancy::front::Front;
use crate::occupancy::{OccupancyGrid, StaticMap};

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
    goal: Point2,
    /// The robot's, metres.
    radius: f64,
    /// What cells count as, of a field whose cells are not those of a map.
    floor: Option<Arc<joined::Joined>>,
    /// Unit vectors in which a descent looks around.
    directions: [Point2; DIRECTIONS],
}

/// Enough for a descent to be robust where the gradient is not (ridges, rims).
const DIRECTIONS: usize = 32;

impl GeodesicField {
    /// Cost factor of cells closer to an obstacle than the robot's radius.
    pub const TIGHT_SLOWNESS: f64 = 6.0;
    /// By how much that factor grows with each metre nearer, up to [`Self::PLANNING_MARGIN`], 1/m: the shortest way
    /// leads through the middle of a door.
    pub const TIGHTER: f64 = 60.0;
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
        let grid = &map.grid;
        let slowness = slowness(map, radius, 0..grid.width(), 0..grid.height());
        Self::marched(Arc::clone(grid), slowness, goal, radius, EXACT_CELLS)
    }

    /// Marches from `goal` over cells that count as so many metres, with a border of one cell around them.
    fn marched(
        grid: Arc<OccupancyGrid>,
        slowness: Vec<f32>,
        goal: Point2,
        radius: f64,
        exact: usize,
    ) -> Self {
        let mut march = March::new(grid.width(), slowness);
        for ((column, row), metres) in beside(&grid, goal, exact) {
            march.start(column, row, metres);
        }
        let metres = march.run();
        Self { grid, metres, goal, radius, floor: None, directions: directions() }
    }

    /// Bytes of memory, without those of the grid.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.metres)
    }

    /// Distance to go from a point, metres, bilinear between cell centres; infinite where the goal
    /// cannot be reached or outside the grid.
    pub fn at(&self, p: Point2) -> f64 {
        let width = self.grid.width();
        let height = self.grid.height();
        let (c, r) = self.grid.grid_from_map(p);
        let c = c - 0.5;
        let r = r - 0.5;
        if c < -0.5 || r < -0.5 || c > width as f64 - 0.5 || r > height as f64 - 0.5 {
            return f64::INFINITY;
        }
        between(&self.metres, (width, height), (c, r))
    }

    /// Shortest way from `start`, a point every `spacing` metres, by steepest descent; empty when the
    /// goal cannot be reached.
    pub fn descend(&self, start: Point2, spacing: f64) -> Vec<Point2> {
        self.descend_for(start, spacing, f64::INFINITY)
    }

    /// The first `length` metres of [`Self::descend`].
    pub fn descend_for(&self, start: Point2, spacing: f64, length: f64) -> Vec<Point2> {
        descend(|p| self.at(p), &self.directions, start, spacing, length)
    }
}

/// Unit vectors, evenly spaced.
fn directions() -> [Point2; DIRECTIONS] {
    std::array::from_fn(|k| {
        let (s, c) = sin_cos(k as f64 * std::f64::consts::TAU / DIRECTIONS as f64);
        Point2::new(c, s)
    })
}

/// Between the values of cells, `[row, column]`, at a column and row that are not whole; the least of the four around
/// it where one of them is infinite.
fn between(metres: &[f32], (width, height): (usize, usize), (c, r): (f64, f64)) -> f64 {
    let c = c.clamp(0.0, (width - 1) as f64);
    let r = r.clamp(0.0, (height - 1) as f64);
    let c0 = c as usize;
    let r0 = r as usize;
    let c1 = (c0 + 1).min(width - 1);
    let r1 = (r0 + 1).min(height - 1);
    let fc = c - c0 as f64;
    let fr = r - r0 as f64;
    let v = |c: usize, r: usize| f64::from(metres[r * width + c]);
    let a = v(c0, r0);
    let b = v(c1, r0);
    let d = v(c0, r1);
    let e = v(c1, r1);
    if a.is_infinite() || b.is_infinite() || d.is_infinite() || e.is_infinite() {
        return a.min(b).min(d).min(e);
    }
    (a * (1.0 - fc) + b * fc) * (1.0 - fr) + (d * (1.0 - fc) + e * fc) * fr
}

/// The first `length` metres of the steepest descent of `at` from `start`, a point every `spacing` metres; empty when
/// the goal cannot be reached.
fn descend(
    at: impl Fn(Point2) -> f64,
    directions: &[Point2],
    start: Point2,
    spacing: f64,
    length: f64,
) -> Vec<Point2> {
    let mut path = vec![start];
    let mut p = start;
    let whole = at(start);
    if !whole.is_finite() {
        return Vec::new();
    }
    let limit = ((4.0 * whole / spacing) as usize + 16).min((length / spacing).ceil() as usize);
    let mut here = whole;
    for _ in 0..limit {
        if here <= spacing {
            break;
        }
        let around = directions.iter().map(|d| {
            let next = Point2::new(p.x + spacing * d.x, p.y + spacing * d.y);
            (at(next), next)
        });
        match around.min_by(|a, b| a.0.total_cmp(&b.0)) {
            Some((least, next)) if least < here => (here, p) = (least, next),
            _ => break,
        }
        path.push(p);
    }
    path
}

/// How far around the goal distances are exact, cells of a map.
const EXACT_CELLS: usize = 3;

/// The cells at most `exact` cells from the goal's with their exact distances: a march has its greatest error there.
fn beside(
    grid: &OccupancyGrid,
    goal: Point2,
    exact: usize,
) -> impl Iterator<Item = ((usize, usize), f32)> + '_ {
    let around = grid.locate(goal).map(move |(column, row)| grid.around(column, row, exact));
    around.into_iter().flatten().map(move |(c, r)| ((c, r), grid.centre(c, r).distance(goal) as f32))
}

/// How many metres one counts as where there is so much room beyond the robot, metres.
fn factor(room: f64) -> f64 {
    if room < 0.0 {
        let depth = (-room).min(GeodesicField::PLANNING_MARGIN);
        return GeodesicField::TIGHT_SLOWNESS + GeodesicField::TIGHTER * depth;
    }
    let comfort = (1.0 - room / GeodesicField::COMFORT).max(0.0);
    1.0 + (GeodesicField::WALL_SLOWNESS - 1.0) * comfort
}

/// Metres that each of these cells counts as, with a border of one cell around them; infinite where nothing can be
/// driven.
fn slowness(map: &StaticMap, radius: f64, columns: Range<usize>, rows: Range<usize>) -> Vec<f32> {
    let grid = &map.grid;
    let clearance = &map.to_obstacle;
    let of_cell = |i: usize| {
        if !grid.is_drivable(i) {
            return f32::INFINITY;
        }
        (factor(clearance.cell(i) - radius) * map.way_factor(i) * grid.resolution()) as f32
    };
    let stride = columns.len() + 2;
    let mut cells = vec![f32::INFINITY; stride * (rows.len() + 2)];
    for (row, cells) in rows.zip(cells.chunks_exact_mut(stride).skip(1)) {
        for (column, cell) in columns.clone().zip(&mut cells[1..]) {
            *cell = of_cell(row * grid.width() + column);
        }
    }
    cells
}

/// The march: cells are settled in the order of their distance, each from those settled before.
struct March {
    /// Cells of a row, with the border.
    stride: usize,
    /// Metres that a cell counts as; infinite once it is settled, and where nothing can be driven.
    slowness: Vec<f32>,
    /// The least distance found for each cell.
    metres: Vec<f32>,
    /// The same of cells that are settled, infinite for all others.
    settled: Vec<f32>,
    front: Front,
}

impl March {
    fn new(width: usize, slowness: Vec<f32>) -> Self {
        let unknown = vec![f32::INFINITY; slowness.len()];
        let slowest = slowness.iter().copied().filter(|s| s.is_finite()).fold(0.0, f32::max);
        let front = Front::new(slowest);
        Self { stride: width + 2, slowness, metres: unknown.clone(), settled: unknown, front }
    }

    /// Index of a cell of the grid.
    fn bordered(&self, column: usize, row: usize) -> usize {
        (row + 1) * self.stride + column + 1
    }

    /// A distance that is known of a cell, unless nothing can be driven there.
    fn start(&mut self, column: usize, row: usize, metres: f32) {
        let index = self.bordered(column, row);
        if self.slowness[index].is_finite() {
            self.offer(index, metres);
        }
    }

    /// A distance of a cell, which counts if it is the least so far.
    fn offer(&mut self, index: usize, metres: f32) {
        if metres < self.metres[index] {
            self.metres[index] = metres;
            self.front.push(metres, index);
        }
    }

    /// The distances of all cells, `[row, column]`, with a rim where nothing can be driven ([`grow_rim`]).
    fn run(mut self) -> Vec<f32> {
        while let Some((metres, index)) = self.front.pop() {
            // A cell whose distance has fallen since is here once more.
            if metres > self.metres[index] {
                continue;
            }
            self.settled[index] = metres;
            self.slowness[index] = f32::INFINITY;
            for next in [index - 1, index + 1, index - self.stride, index + self.stride] {
                if self.slowness[next].is_finite() {
                    self.offer(next, self.eikonal(next));
                }
            }
        }
        let mut bordered = self.metres;
        let stride = self.stride;
        grow_rim(&mut bordered, stride);
        grow_rim(&mut bordered, stride);
        let rows = bordered.chunks_exact(stride).skip(1).take(bordered.len() / stride - 2);
        let mut metres = Vec::with_capacity(bordered.len());
        rows.for_each(|row| metres.extend_from_slice(&row[1..stride - 1]));
        metres
    }

    /// First-order upwind solution of |grad T| = slowness at one cell.
    fn eikonal(&self, index: usize) -> f32 {
        let settled = &self.settled;
        let slowness = self.slowness[index];
        let a = settled[index - 1].min(settled[index + 1]);
        let b = settled[index - self.stride].min(settled[index + self.stride]);
        let difference = (a - b).abs();
        if difference >= slowness || !difference.is_finite() {
            a.min(b) + slowness
        } else {
            0.5 * (a + b + (2.0 * slowness * slowness - difference * difference).sqrt())
        }
    }
}

/// Gives unreachable cells beside reachable ones a value one metre per cell above the least neighbour, which keeps
/// interpolation finite at walls and points away from them. `stride` cells are a row; the border stays as it is.
fn grow_rim(metres: &mut [f32], stride: usize) {
    let least = |a: &[f32], b: &[f32]| -> Vec<f32> { a.iter().zip(b).map(|(a, b)| a.min(*b)).collect() };
    let of_three = |row: &[f32]| least(&least(&row[..stride - 2], &row[1..stride - 1]), &row[2..]);
    let mut rows = metres.chunks_exact(stride).map(of_three).collect::<Vec<_>>().into_iter();
    let (Some(mut below), Some(mut here)) = (rows.next(), rows.next()) else { return };
    for (row, above) in metres.chunks_exact_mut(stride).skip(1).zip(rows) {
        let around = least(&least(&below, &here), &above);
        for (cell, around) in row[1..].iter_mut().zip(around) {
            *cell = if cell.is_finite() { *cell } else { around + 1.0 };
        }
        (below, here) = (here, above);
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
