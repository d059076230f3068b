//! Directions of walls in an occupancy grid, by a line fitted to the surface around each cell.

use crate::occupancy::{Cell, OccupancyGrid};

/// Radius of the neighbourhood a line is fitted to, cells: long enough to average the stairs of an
/// oblique wall, short enough to see a corner as a corner.
const RADIUS: i64 = 4;
/// From this ratio of the least to the greatest spread on, the surface has no direction: a post.
const ISOTROPIC: f64 = 0.4;

const SIDES: [(i64, i64); 4] = [(-1, 0), (1, 0), (0, -1), (0, 1)];
const CORNERS: [(i64, i64); 4] = [(-1, -1), (1, -1), (-1, 1), (1, 1)];

/// Unit normal of each surface cell in the grid's axes; the sign is arbitrary.
pub(super) struct WallNormals {
    normals: Vec<[f32; 2]>,
}

impl WallNormals {
    /// Fits lines to the surface: occupied cells that share a side with one that is not. A ray may also
    /// end on a cell that only touches such a one in a corner, so these get a normal too.
    pub(super) fn new(grid: &OccupancyGrid) -> Self {
        let width = grid.width();
        let height = grid.height();
        let solid = |column: i64, row: i64| {
            let inside = column >= 0 && row >= 0 && column < width as i64 && row < height as i64;
            inside && grid.cell(grid.index(column as usize, row as usize)) == Cell::Occupied
        };
        let covered = |i: usize, sides: &[(i64, i64)]| {
            let column = (i % width) as i64;
            let row = (i / width) as i64;
            sides.iter().all(|(dx, dy)| solid(column + dx, row + dy))
        };
        let occupied = |i: usize| grid.cell(i) == Cell::Occupied;
        let surface: Vec<bool> = (0..width * height).map(|i| occupied(i) && !covered(i, &SIDES)).collect();
        let mut normals = vec![[0.0; 2]; width * height];
        for (i, normal) in normals.iter_mut().enumerate() {
            if occupied(i) && (surface[i] || !covered(i, &CORNERS)) {
                *normal = fit(&surface, width, height, i);
            }
        }
        Self { normals }
    }

    /// Normal of the wall at a cell; none for a post, which looks the same from every side.
    pub(super) fn at(&self, cell: usize) -> Option<(f64, f64)> {
        let [x, y] = self.normals[cell];
        (x != 0.0 || y != 0.0).then(|| (f64::from(x), f64::from(y)))
    }
}

/// Direction of least spread of the surface cells around cell `index`, weighted down towards the rim
/// of the neighbourhood; zero if there is none.
fn fit(surface: &[bool], width: usize, height: usize, index: usize) -> [f32; 2] {
    let column = (index % width) as i64;
    let row = (index / width) as i64;
    let mut n = 0.0;
    let mut mx = 0.0;
    let mut my = 0.0;
    let mut xx = 0.0;
    let mut xy = 0.0;
    let mut yy = 0.0;
    for dy in -RADIUS..=RADIUS {
        for dx in -RADIUS..=RADIUS {
            let c = column + dx;
            let r = row + dy;
            let inside = c >= 0 && r >= 0 && c < width as i64 && r < height as i64;
            let share = 1.0 - (dx * dx + dy * dy) as f64 / ((RADIUS * RADIUS) as f64 + 1.0);
            if share <= 0.0 || !inside || !surface[r as usize * width + c as usize] {
                continue;
            }
            let x = dx as f64;
            let y = dy as f64;
            n += share;
            mx += share * x;
            my += share * y;
            xx += share * x * x;
            xy += share * x * y;
            yy += share * y * y;
        }
    }
    let a = xx / n - (mx / n) * (mx / n);
    let b = xy / n - mx * my / (n * n);
    let d = yy / n - (my / n) * (my / n);
    let mean = 0.5 * (a + d);
    let half = 0.5 * (a - d);
    let root = (half * half + b * b).sqrt();
    if mean <= 0.0 || mean - root >= ISOTROPIC * (mean + root) {
        return [0.0; 2];
    }
    // Eigenvector of the greatest spread; the normal is across it.
    let (x, y) = if half >= 0.0 { (half + root, b) } else { (b, root - half) };
    let length = (x * x + y * y).sqrt();
    [(-y / length) as f32, (x / length) as f32]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use crate::numerics::sin_cos;

    /// Half plane, or a wall `thickness` cells thick, through the centre of a 101 x 101 grid, with
    /// the normal at `angle`.
    fn wall(angle: f64, thickness: f64) -> OccupancyGrid {
        let (s, c) = sin_cos(angle);
        let cells = (0..101 * 101)
            .map(|i| {
                let depth = (f64::from(i % 101) - 50.0) * c + (f64::from(i / 101) - 50.0) * s;
                if (-0.5..thickness - 0.5).contains(&depth) { 100 } else { 0 }
            })
            .collect();
        OccupancyGrid::new(101, 101, 0.05, Pose2::default(), cells).unwrap()
    }

    fn worst_error_deg(angle: f64, thickness: f64) -> f64 {
        let grid = wall(angle, thickness);
        let normals = WallNormals::new(&grid);
        let (s, c) = sin_cos(angle);
        let mut worst: f64 = 0.0;
        let open = |c: usize, r: usize| grid.cell(grid.index(c, r)) != Cell::Occupied;
        for row in 30..70 {
            for column in 30..70 {
                let i = grid.index(column, row);
                let depth = (column as f64 - 50.0) * c + (row as f64 - 50.0) * s;
                let visible = open(column - 1, row)
                    || open(column + 1, row)
                    || open(column, row - 1)
                    || open(column, row + 1);
                if grid.cell(i) == Cell::Occupied && depth < 1.0 && visible {
                    let (x, y) = normals.at(i).unwrap();
                    worst = worst.max((x * c + y * s).abs().min(1.0).acos().to_degrees());
                }
            }
        }
        worst
    }

    #[test]
    fn straight_and_diagonal_walls_are_within_five_degrees() {
        for thickness in [1.0, 2.0, 3.0, 60.0] {
            for angle_deg in [0.0_f64, 90.0, 180.0, 45.0, 135.0] {
                let error = worst_error_deg(angle_deg.to_radians(), thickness);
                assert!(error < 5.0, "{angle_deg} deg, {thickness} cells: off by {error} deg");
            }
        }
    }

    #[test]
    fn walls_at_any_angle_are_within_twelve_degrees() {
        for i in 0..36 {
            for thickness in [1.5, 60.0] {
                let error = worst_error_deg(f64::from(5 * i).to_radians(), thickness);
                assert!(error < 12.0, "{} deg, {thickness} cells: off by {error} deg", 5 * i);
            }
        }
    }

    #[test]
    fn a_post_has_no_normal() {
        let mut cells = vec![0_i8; 400];
        cells[10 * 20 + 10] = 100;
        for (c, r) in [(3, 3), (4, 3), (3, 4), (4, 4)] {
            cells[r * 20 + c] = 100;
        }
        let grid = OccupancyGrid::new(20, 20, 0.05, Pose2::default(), cells).unwrap();
        let normals = WallNormals::new(&grid);
        assert_eq!(normals.at(grid.index(10, 10)), None);
        assert_eq!(normals.at(grid.index(3, 3)), None);
    }
}
