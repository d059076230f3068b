//! How far a ray goes until it meets something: sphere tracing over the distance to occupied cells (Hart, 1996).

use crate::occupancy::StaticMap;

/// Where a ray ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hit {
    /// Length of the ray, cells.
    pub range: f64,
    /// Index of the cell that it meets.
    pub cell: usize,
}

/// Casts rays over one grid against its occupied cells; all lengths in cells, all directions in the grid's axes.
/// Unknown cells are looked through, and there is nothing outside the grid.
///
/// There are two ways to go: [`Self::cast`] for many rays from one point, which is fast, and [`Self::range`] for exact
/// lengths.
#[derive(Debug, Clone, Copy)]
pub struct RayCaster<'a> {
    metres: &'a [f32],
    width: usize,
    height: usize,
    per_metre: f64,
}

/// A ray under way.
#[derive(Clone, Copy)]
struct Ray {
    range: f64,
    /// Column and row one step ago, if that step was so short that it may have cut a corner.
    before: Option<(u32, u32)>,
    hit: Option<Hit>,
}

impl<'a> RayCaster<'a> {
    /// Step beside a wall, cells: never more than one new column and one new row at a time.
    const SHORTEST: f64 = 0.5;
    /// What the distance from a cell's centre to a wall's centre may fall short of the distance from a
    /// point of the one to a point of the other: a diagonal, rounded up.
    const SLACK: f64 = 1.42;

    /// Casts rays over `map`.
    pub fn new(map: &'a StaticMap) -> Self {
        let (width, height) = map.to_occupied.size();
        Self { metres: map.to_occupied.metres(), width, height, per_metre: 1.0 / map.grid.resolution() }
    }

    /// Distance from a cell's centre to the nearest occupied one's, cells; none outside the grid.
    #[inline]
    pub fn clearance(&self, column: i64, row: i64) -> Option<f64> {
        let inside = column >= 0 && row >= 0 && column < self.width as i64 && row < self.height as i64;
        inside.then(|| f64::from(self.metres[row as usize * self.width + column as usize]) * self.per_metre)
    }

    /// Length of the ray from `origin` towards a unit vector to the first occupied cell, if it meets one before
    /// `reach`: exact, from cell to cell (Amanatides and Woo, 1987), with leaps where nothing is near.
    pub fn range(&self, (ox, oy): (f64, f64), (dx, dy): (f64, f64), reach: f64) -> Option<f64> {
        let inverse_x = 1.0 / dx;
        let inverse_y = 1.0 / dy;
        let mut column = ox.floor() as i64;
        let mut row = oy.floor() as i64;
        let mut t = 0.0_f64;
        while t < reach {
            let clearance = self.clearance(column, row)?;
            if clearance == 0.0 {
                return Some(t);
            }
            let leap = clearance - Self::SLACK;
            if leap > 1.0 {
                t += leap;
                column = (ox + t * dx).floor() as i64;
                row = (oy + t * dy).floor() as i64;
                continue;
            }
            let to_column = edge(column, ox, dx, inverse_x);
            let to_row = edge(row, oy, dy, inverse_y);
            if to_column < to_row {
                t = t.max(to_column);
                column += if dx > 0.0 { 1 } else { -1 };
            } else {
                t = t.max(to_row);
                row += if dy > 0.0 { 1 } else { -1 };
            }
        }
        None
    }

    /// First occupied cell from `from` towards each of N unit vectors, not farther than `reach`, if there is one.
    /// Lengths are good to half a cell.
    ///
    /// All rays take their steps in turn: each step waits for memory, and the steps of other rays fill the time.
    pub fn cast<const N: usize>(
        &self,
        from: (f64, f64),
        directions: &[(f64, f64); N],
        reach: f64,
    ) -> [Option<Hit>; N] {
        // The first step is the same for all.
        let mut first = Ray { range: 0.0, before: None, hit: None };
        let mut count = if self.step(&mut first, from, (0.0, 0.0), reach) { N } else { 0 };
        let mut rays = [first; N];
        let mut open: [usize; N] = std::array::from_fn(|i| i);
        while count > 0 {
            let mut left = 0;
            for k in 0..count {
                let i = open[k];
                let goes_on = self.step(&mut rays[i], from, directions[i], reach);
                open[left] = i;
                left += usize::from(goes_on);
            }
            count = left;
        }
        rays.map(|ray| ray.hit)
    }

    /// One step of a ray; whether there is another.
    #[inline(always)]
    fn step(&self, ray: &mut Ray, (x, y): (f64, f64), (dx, dy): (f64, f64), reach: f64) -> bool {
        let px = x + ray.range * dx;
        let py = y + ray.range * dy;
        // Conversions to 32 bits are faster.
        let column = px as u32;
        let row = py as u32;
        let inside =
            (px >= 0.0) & (py >= 0.0) & ((column as usize) < self.width) & ((row as usize) < self.height);
        if !inside {
            return false;
        }
        let cell = row as usize * self.width + column as usize;
        let clearance = f64::from(self.metres[cell]) * self.per_metre;
        if clearance == 0.0 {
            ray.hit = Some(Hit { range: ray.range, cell });
            return false;
        }
        // Between two steps that change both indices lies a third cell. A ray must not slip through the joint of two
        // cells that touch in a corner.
        if let Some((c, r)) = ray.before.filter(|&(c, r)| c != column && r != row) {
            let corner = [row as usize * self.width + c as usize, r as usize * self.width + column as usize];
            if let Some(&cell) = corner.iter().find(|&&i| self.metres[i] == 0.0) {
                ray.hit = Some(Hit { range: ray.range, cell });
                return false;
            }
        }
        // Neither the point nor the nearest obstacle's edge is at a cell's centre.
        let step = clearance - std::f64::consts::SQRT_2;
        ray.before = (step < Self::SHORTEST).then_some((column, row));
        ray.range += step.max(Self::SHORTEST);
        ray.range <= reach
    }
}

/// Length of a ray where it leaves the cell along one axis.
fn edge(cell: i64, origin: f64, direction: f64, inverse: f64) -> f64 {
    if direction > 0.0 {
        ((cell + 1) as f64 - origin) * inverse
    } else if direction < 0.0 {
        (cell as f64 - origin) * inverse
    } else {
        f64::INFINITY
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::Pose2;
    use crate::numerics::sin_cos;
    use crate::occupancy::OccupancyGrid;
    use crate::random::{rng, uniform};

    #[test]
    fn agrees_with_a_fine_march() {
        let mut r = rng(1, 0);
        let cells: Vec<i8> = (0..10_000).map(|_| if uniform(&mut r) < 0.01 { 100 } else { 0 }).collect();
        let grid = OccupancyGrid::new(100, 100, 0.05, Pose2::default(), cells).unwrap();
        let map = StaticMap::new(grid);
        let caster = RayCaster::new(&map);
        let mut differences = 0;
        for _ in 0..2000 {
            let from = (100.0 * uniform(&mut r), 100.0 * uniform(&mut r));
            let (s, c) = sin_cos(7.0 * uniform(&mut r));
            let slow = (0..8000).map(|i| 0.01 * f64::from(i)).take_while(|t| *t <= 80.0).find_map(|t| {
                let x = from.0 + t * c;
                let y = from.1 + t * s;
                let inside = x >= 0.0 && y >= 0.0 && x < 100.0 && y < 100.0;
                if !inside {
                    return Some(None);
                }
                (map.to_occupied.cell(y as usize * 100 + x as usize) == 0.0).then_some(Some(t))
            });
            let fast = caster.cast(from, &[(c, s)], 80.0)[0].map(|h| h.range);
            let same = match (slow.flatten(), fast) {
                (Some(a), Some(b)) => (a - b).abs() <= 0.51,
                (None, None) => true,
                _ => false,
            };
            differences += usize::from(!same);
        }
        // Rays that clip a corner of one of these single cells by less than a step may miss it, or
        // pass beside it and still be stopped.
        assert!(differences < 120, "{differences} of 2000 rays differ");
    }

    #[test]
    fn rays_that_are_cast_together_end_where_each_ends_alone() {
        for seed in 0..5 {
            let mut r = rng(seed, 3);
            let cells = (0..10_000).map(|_| if uniform(&mut r) < 0.02 { 100 } else { 0 }).collect();
            let map = StaticMap::new(OccupancyGrid::new(100, 100, 0.05, Pose2::default(), cells).unwrap());
            let caster = RayCaster::new(&map);
            let mut hits = 0;
            for _ in 0..200 {
                let from = (100.0 * uniform(&mut r), 100.0 * uniform(&mut r));
                let directions: [(f64, f64); 9] = std::array::from_fn(|_| {
                    let (s, c) = sin_cos(7.0 * uniform(&mut r));
                    (c, s)
                });
                let together = caster.cast(from, &directions, 20.0);
                for (hit, direction) in together.iter().zip(directions) {
                    assert_eq!(*hit, caster.cast(from, &[direction], 20.0)[0], "seed {seed}");
                    hits += usize::from(hit.is_some());
                }
            }
            assert!((100..1700).contains(&hits), "seed {seed}: {hits} of 1800 rays end");
        }
    }

    #[test]
    fn a_one_cell_diagonal_wall_does_not_leak() {
        let cells = (0..2500).map(|i| if i % 50 + i / 50 == 50 { 100 } else { 0 }).collect();
        let grid = OccupancyGrid::new(50, 50, 0.05, Pose2::default(), cells).unwrap();
        let map = StaticMap::new(grid);
        let caster = RayCaster::new(&map);
        let mut r = rng(2, 0);
        for _ in 0..2000 {
            let from = (5.0 + 10.0 * uniform(&mut r), 5.0 + 10.0 * uniform(&mut r));
            let (s, c) = sin_cos(0.5 + 0.57 * uniform(&mut r));
            assert!(caster.cast(from, &[(c, s)], 60.0)[0].is_some(), "leaked from {from:?} towards {c} {s}");
        }
    }
}
