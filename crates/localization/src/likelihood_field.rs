//! The likelihood field: how well a beam that ends at a point fits the map (Thrun, Burgard and Fox,
//! Probabilistic Robotics, 2005, section 6.4).

use curionav_planning::geometry::Point2;
use curionav_planning::numerics::{exp, ln, sin_cos};
use curionav_planning::occupancy::{RayCaster, StaticMap};

use crate::params::{LaserLikelihood, LocalizerParams};
use crate::surfaces::Surfaces;

/// One score per cell, looked up for every beam of every particle. For the prob model the score is ln
/// p(z), for the plain one p(z)^3, with `p(z) = z_hit exp(-d^2 / (2 sigma_hit^2)) + z_rand / range_max`
/// and d the distance from the cell to the nearest obstacle's surface, at most `max_distance`.
///
/// Beams end on surfaces. ROS takes the distance to the nearest occupied cell's centre, which is nought
/// all through a thick wall, so that a robot that sees a wall from one side only is drawn into it.
///
/// A border of one cell around the map holds the score of `max_distance`, so that a look-up is a
/// clamp and a load.
pub(crate) struct LikelihoodField {
    last_column: i32,
    last_row: i32,
    stride: usize,
    scores: Vec<f32>,
    /// Score of a beam that ends right on a surface, the greatest there is.
    pub(crate) perfect: f32,
    map: StaticMap,
    cells_per_metre: f64,
}

/// A particle's pose in the field's own units: cells, f32, border included.
#[derive(Clone, Copy, Default)]
pub(crate) struct FieldPose {
    column: f32,
    row: f32,
    cos: f32,
    sin: f32,
}

impl FieldPose {
    /// Column and row of the point (x, y) metres of the robot frame.
    #[inline]
    fn place(self, x: f32, y: f32) -> (f32, f32) {
        (self.column + (self.cos * x - self.sin * y), self.row + (self.sin * x + self.cos * y))
    }
}

impl LikelihoodField {
    pub(crate) fn new(surfaces: &Surfaces, range_max: f64, params: &LocalizerParams) -> Self {
        let map = &surfaces.map;
        let (width, height) = map.to_occupied.size();
        let stride = width + 2;
        let mut scores = vec![score(params.max_distance, range_max, params); stride * (height + 2)];
        let mut known = Known::new(|distance| score(distance, range_max, params));
        for (row, distances) in surfaces.metres.chunks_exact(width).enumerate() {
            let start = (row + 1) * stride + 1;
            for (cell, &distance) in scores[start..start + width].iter_mut().zip(distances) {
                *cell = known.score(distance.abs());
            }
        }
        Self {
            last_column: width as i32 + 1,
            last_row: height as i32 + 1,
            stride,
            scores,
            perfect: score(0.0, range_max, params),
            map: map.clone(),
            cells_per_metre: 1.0 / map.grid.resolution(),
        }
    }

    /// The greatest score less the least.
    pub(crate) fn span(&self) -> f64 {
        f64::from(self.perfect - self.scores[0])
    }

    /// The scores of the map's cells in 255 steps between the least and the greatest, rounded up.
    pub(crate) fn quantised(&self) -> Vec<u8> {
        let least = self.scores[0];
        let steps = 255.0 / self.span() as f32;
        let rows = self.scores.chunks_exact(self.stride).skip(1).take(self.last_row as usize - 1);
        let inner = rows.flat_map(|row| &row[1..self.last_column as usize]);
        inner.map(|score| ((score - least) * steps).ceil() as u8).collect()
    }

    /// A robot pose, ready for [`Self::score`].
    pub(crate) fn pose(&self, x: f64, y: f64, heading: f64) -> FieldPose {
        let grid = &self.map.grid;
        let p = grid.from_corner(Point2::new(x, y));
        let (s, c) = sin_cos(heading - grid.origin().heading);
        FieldPose {
            column: (p.x * self.cells_per_metre + 1.0) as f32,
            row: (p.y * self.cells_per_metre + 1.0) as f32,
            cos: (c * self.cells_per_metre) as f32,
            sin: (s * self.cells_per_metre) as f32,
        }
    }

    /// Score of a beam that ends at (x, y) metres in the robot frame.
    #[inline]
    pub(crate) fn score(&self, pose: FieldPose, x: f32, y: f32) -> f32 {
        let (column, row) = pose.place(x, y);
        let (column, row) = self.bordered(column, row);
        self.scores[row * self.stride + column]
    }

    /// Column and row of a place, border included.
    #[inline]
    fn bordered(&self, column: f32, row: f32) -> (usize, usize) {
        // The cast cuts towards zero: what lies between -1 and 0 is border too.
        let column = (column as i32).clamp(0, self.last_column) as usize;
        (column, (row as i32).clamp(0, self.last_row) as usize)
    }

    /// Whether an obstacle lies between two points of the robot frame, metres, or the first is in one: steps
    /// as long as the distance field says nothing can be met.
    pub(crate) fn blocked(&self, pose: FieldPose, from: (f32, f32), to: (f32, f32)) -> bool {
        let (x, y) = pose.place(from.0, from.1);
        let (to_x, to_y) = pose.place(to.0, to.1);
        let dx = to_x - x;
        let dy = to_y - y;
        let length = (dx * dx + dy * dy).sqrt();
        // Where the way has left the map for good, its border included; infinite or NaN if it never does.
        let [end_x, end_y] = [(x, dx, self.last_column), (y, dy, self.last_row)].map(|(at, by, last)| {
            let room = if by > 0.0 { last as f32 + 1.0 - at } else { at };
            room / by.abs() * length
        });
        let end = end_x.min(end_y).min(RESOLVED);
        let mut share = 0.0;
        let mut travelled = 0.0;
        let rays = RayCaster::new(&self.map);
        loop {
            let (column, row) = self.bordered(x + share * dx, y + share * dy);
            let clear = rays.clearance(column as i64 - 1, row as i64 - 1).map_or(BEYOND, |c| c as f32);
            if clear < 0.5 {
                return true;
            }
            travelled += (clear - 1.0).max(0.5);
            // A length that is not a number ends it too.
            if travelled < length && travelled < end {
                share = travelled / length;
            } else {
                return false;
            }
        }
    }
}

/// What a beam says whose end is so many metres from the nearest obstacle.
fn score(distance: f64, range_max: f64, params: &LocalizerParams) -> f32 {
    let d = distance.min(params.max_distance);
    let p =
        params.z_hit * exp(-d * d / (2.0 * params.sigma_hit * params.sigma_hit)) + params.z_rand / range_max;
    (match params.model {
        LaserLikelihood::Prob => ln(p),
        LaserLikelihood::Plain => p * p * p,
    }) as f32
}

/// Clearance outside the map, cells.
const BEYOND: f32 = 2.0;
/// Cells up to which half a cell more is another number in single precision.
const RESOLVED: f32 = 8_388_608.0;

/// A score by distance, with those found last: a map has few different distances.
struct Known<F> {
    score: F,
    found: Vec<(f32, f32)>,
}

impl<F: Fn(f64) -> f32> Known<F> {
    const PLACES_LOG2: u32 = 12;

    fn new(score: F) -> Self {
        let nought = (0.0, score(0.0));
        Self { score, found: vec![nought; 1 << Self::PLACES_LOG2] }
    }

    fn score(&mut self, distance: f32) -> f32 {
        // Multiplied by 2^32 over the golden ratio, numbers that are near each other lie far apart (Knuth).
        let place = distance.to_bits().wrapping_mul(0x9E37_79B1) >> (32 - Self::PLACES_LOG2);
        let found = &mut self.found[place as usize];
        if found.0 != distance {
            *found = (distance, (self.score)(f64::from(distance)));
        }
        found.1
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::geometry::Pose2;
    use curionav_planning::occupancy::{Cell, OccupancyGrid};
    use curionav_planning::random::{rng, uniform};

    fn to_surface(map: &StaticMap) -> Vec<f32> {
        Surfaces::new(map).metres.iter().map(|metres| metres.abs()).collect()
    }

    #[test]
    fn a_look_up_is_the_formula_on_the_distance_field() {
        let cells = (0..50 * 40).map(|i| if i % 37 == 0 { 100 } else { 0 }).collect();
        let grid = OccupancyGrid::new(50, 40, 0.1, Pose2::new(-1.0, 2.0, 0.4), cells).unwrap();
        let map = StaticMap::new(grid);
        let params = LocalizerParams::default();
        let field = LikelihoodField::new(&Surfaces::new(&map), 5.0, &params);
        let surface = to_surface(&map);
        let mut r = rng(3, 0);
        let mut compared = 0;
        for _ in 0..5000 {
            let mut draw = |a: f64, b: f64| a + (b - a) * uniform(&mut r);
            let pose = Pose2::new(draw(-3.0, 5.0), draw(1.0, 8.0), draw(-3.0, 3.0));
            let beam = Point2::new(draw(-3.0, 3.0), draw(-3.0, 3.0));
            let end = pose.transform(beam);
            let (column, row) = map.grid.grid_from_map(end);
            if (column - column.round()).abs() < 1e-3 || (row - row.round()).abs() < 1e-3 {
                continue; // on a cell's edge f32 may fall on either side
            }
            let d = map.grid.locate(end).map_or(2.0, |(c, r)| f64::from(surface[map.grid.index(c, r)]));
            let expected = (0.95 * (-d * d / 0.08).exp() + 0.05 / 5.0).ln();
            let found = field.score(field.pose(pose.x, pose.y, pose.heading), beam.x as f32, beam.y as f32);
            assert!((f64::from(found) - expected).abs() < 1e-4, "{pose:?} {beam:?}");
            compared += 1;
        }
        assert!(compared > 4000);
    }

    #[test]
    fn distance_to_the_surface_is_the_same_on_both_sides_of_a_thick_wall() {
        // 12 cells of 0.1 m, the last six solid: the surface is between cells 5 and 6.
        let cells = (0..12).map(|i| if i >= 6 { 100 } else { 0 }).collect();
        let map = StaticMap::new(OccupancyGrid::new(12, 1, 0.1, Pose2::default(), cells).unwrap());
        let surface = to_surface(&map);
        for k in 0..6 {
            assert!((surface[5 - k] - (0.05 + 0.1 * k as f32)).abs() < 1e-6);
            assert_eq!(surface[5 - k], surface[6 + k]);
        }
    }

    #[test]
    fn a_way_is_blocked_where_fine_steps_along_it_meet_an_obstacle() {
        let cells = (0..50 * 40).map(|i| if i % 37 == 0 { 100 } else { 0 }).collect();
        let map = StaticMap::new(OccupancyGrid::new(50, 40, 0.1, Pose2::new(-1.0, 2.0, 0.4), cells).unwrap());
        let field = LikelihoodField::new(&Surfaces::new(&map), 5.0, &LocalizerParams::default());
        let occupied = |p: Point2| {
            map.grid.locate(p).is_some_and(|(c, r)| map.grid.cell(map.grid.index(c, r)) == Cell::Occupied)
        };
        let mut r = rng(4, 0);
        let (mut same, mut blocked) = (0, 0);
        for _ in 0..2000 {
            let mut draw = |a: f64, b: f64| a + (b - a) * uniform(&mut r);
            let pose = Pose2::new(draw(-2.0, 4.0), draw(1.0, 7.0), draw(-3.0, 3.0));
            let to = Point2::new(draw(-1.0, 1.0), draw(-1.0, 1.0));
            let reference = (0..=1000).any(|k| {
                let s = f64::from(k) / 1000.0;
                occupied(pose.transform(Point2::new(s * to.x, s * to.y)))
            });
            let at = field.pose(pose.x, pose.y, pose.heading);
            let found = field.blocked(at, (0.0, 0.0), (to.x as f32, to.y as f32));
            assert!(!found || reference, "{pose:?} {to:?}");
            same += i32::from(found == reference);
            blocked += i32::from(reference);
        }
        // Only a corner that is cut by less than half a cell may be stepped over.
        assert!(same > 1950 && blocked > 200, "{same} {blocked}");
    }

    #[test]
    fn a_way_without_end_ends() {
        let (answer, answered) = std::sync::mpsc::channel();
        std::thread::spawn(move || {
            let cells = (0..50 * 40).map(|i| if i % 50 == 10 { 100 } else { 0 }).collect();
            let map = StaticMap::new(OccupancyGrid::new(50, 40, 0.1, Pose2::default(), cells).unwrap());
            let field = LikelihoodField::new(&Surfaces::new(&map), 5.0, &LocalizerParams::default());
            let pose = field.pose(3.0, 2.0, 0.0);
            let ends = [(-1e12, 0.0), (1e12, 0.0), (0.0, -1e12), (1e12, 1e12), (f32::NAN, f32::NAN)];
            answer.send(ends.map(|end| field.blocked(pose, (0.0, 0.0), end)))
        });
        // Without the thread, a way that does not end would not fail but hang.
        let found = answered.recv_timeout(std::time::Duration::from_secs(60));
        assert_eq!(found, Ok([true, false, false, false, false]));
    }
}
