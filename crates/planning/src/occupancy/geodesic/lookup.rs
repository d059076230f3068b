//! The distance to go from eight points at a time.

use super::GeodesicField;
use crate::lanes::{LANES, Select, Simd, SimdBase, f64x8, floor, greater, indices, lesser};

impl GeodesicField {
    /// [`Self::at`] of each point, bit for bit.
    #[inline(always)]
    pub(crate) fn at_each<S: Simd>(&self, x: f64x8<S>, y: f64x8<S>) -> f64x8<S> {
        let grid = &self.grid;
        let origin = grid.origin();
        let (s, c) = grid.turn();
        let dx = x - origin.x;
        let dy = y - origin.y;
        let column = (c * dx + s * dy) / grid.resolution() - 0.5;
        let row = (-s * dx + c * dy) / grid.resolution() - 0.5;

        let width = grid.width() as f64;
        let height = grid.height() as f64;
        let outside = column.simd_lt(-0.5)
            | row.simd_lt(-0.5)
            | column.simd_gt(width - 0.5)
            | row.simd_gt(height - 0.5);
        let column = within(column, width - 1.0);
        let row = within(row, height - 1.0);
        let column_0 = floor(column);
        let row_0 = floor(row);
        let u = column - column_0;
        let v = row - row_0;

        // The next cell, or the same one at the rim.
        let cell = row_0 * width + column_0;
        let zero = f64x8::splat(x.simd, 0.0);
        let right = column_0.simd_lt(width - 1.0).select(f64x8::splat(x.simd, 1.0), zero);
        let up = row_0.simd_lt(height - 1.0).select(f64x8::splat(x.simd, width), zero);
        let a = self.of_cells(cell);
        let b = self.of_cells(cell + right);
        let d = self.of_cells(cell + up);
        let e = self.of_cells(cell + right + up);
        let between = (a * (1.0 - u) + b * u) * (1.0 - v) + (d * (1.0 - u) + e * u) * v;
        // Beside cells without a way there is nothing between: the least of the four counts.
        let no_way = (a + b + d + e).simd_ge(f64::INFINITY);
        let metres = no_way.select(lesser(lesser(a, b), lesser(d, e)), between);
        outside.select(f64x8::splat(x.simd, f64::INFINITY), metres)
    }

    #[inline(always)]
    fn of_cells<S: Simd>(&self, cells: f64x8<S>) -> f64x8<S> {
        let at: [usize; LANES] = indices(cells);
        let metres = &self.metres[..];
        f64x8::from_fn(cells.simd, |lane| metres.get(at[lane]).map_or(f64::INFINITY, |&m| f64::from(m)))
    }
}

/// The numbers, from 0 to `most`.
#[inline(always)]
fn within<S: Simd>(x: f64x8<S>, most: f64) -> f64x8<S> {
    lesser(greater(x, f64x8::splat(x.simd, 0.0)), f64x8::splat(x.simd, most))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::geometry::{Point2, Pose2};
    use crate::lanes::{dispatch, tests::levels};
    use crate::occupancy::{OccupancyGrid, StaticMap};
    use crate::random::{rng, uniform};

    #[test]
    fn eight_points_at_a_time_are_looked_up_as_one_by_one_bit_for_bit() {
        for seed in 0..20 {
            let mut r = rng(seed, 0);
            let origin = Pose2::new(-1.0, 2.0, if seed % 2 == 0 { 0.0 } else { 0.7 });
            let cells = (0..60 * 40).map(|_| if uniform(&mut r) < 0.3 { 100 } else { 0 }).collect();
            let grid = OccupancyGrid::new(60, 40, 0.1, origin, cells).unwrap();
            let field =
                GeodesicField::new(&StaticMap::new(grid), origin.transform(Point2::new(3.0, 2.0)), 0.1);
            let mut ways = [0; 2];
            for _ in 0..2000 {
                // Some lie outside, and some on the edges of cells.
                let mut coordinate = |size: f64| {
                    let at = (1.4 * uniform(&mut r) - 0.2) * size;
                    if uniform(&mut r) < 0.2 { (20.0 * at).round() / 20.0 } else { at }
                };
                let points: [Point2; LANES] =
                    std::array::from_fn(|_| origin.transform(Point2::new(coordinate(6.0), coordinate(4.0))));
                for level in levels() {
                    let found: [f64; LANES] = dispatch!(level, simd => {
                        let lanes = |of: fn(&Point2) -> f64| f64x8::from_fn(simd, |lane| of(&points[lane]));
                        field.at_each(lanes(|p| p.x), lanes(|p| p.y)).into()
                    });
                    for (&p, found) in points.iter().zip(found) {
                        assert_eq!(found.to_bits(), field.at(p).to_bits(), "seed {seed}, {level:?}, {p:?}");
                        ways[usize::from(found.is_finite())] += 1;
                    }
                }
            }
            assert!(ways[0] > 1000 && ways[1] > 1000, "both kinds of points: {ways:?}");
        }
    }
}
