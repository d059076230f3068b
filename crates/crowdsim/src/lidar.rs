//! The laser as it really measures: rays against the map and against people, with noise.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::{atan2, sin_cos};
use curionav_planning::occupancy::{RayCaster, StaticMap};
use curionav_planning::random::{Rng, standard_normal, uniform};
use curionav_planning::scene::People;
use curionav_planning::sensor::LaserModel;

/// What the laser meets of people: upright cylinders of one radius.
#[derive(Debug, Clone)]
pub struct Bodies {
    /// Map frame.
    pub centres: Vec<Point2>,
    /// Radius of each, metres.
    pub radius: f64,
}

impl Bodies {
    /// The disc that stands for each of them.
    pub fn discs(people: &People) -> Self {
        Self { centres: (0..people.len()).map(|i| people.position(i)).collect(), radius: people.radius }
    }
}

/// One scan from the robot's true pose: a range for each beam, metres, `range_max` where nothing is
/// met. One normal number is drawn for each beam, hit or not, so that the noise of a beam does
/// not depend on what the others see.
pub fn scan(laser: &LaserModel, map: &StaticMap, robot: Pose2, people: &Bodies, rng: &mut Rng) -> Vec<f32> {
    let range_max = laser.range_max;
    let noisy = ranges(laser, map, robot, people).into_iter().map(|range| {
        let noise = laser.range_sigma * standard_normal(rng);
        (if range < range_max { (range + noise).clamp(0.0, range_max) } else { range_max }) as f32
    });
    noisy.collect()
}

/// Makes each beam say nothing by this chance, whatever the others do.
pub fn silence(ranges: &mut [f32], share: f64, rng: &mut Rng) {
    for range in ranges {
        if uniform(rng) < share {
            *range = f32::NAN;
        }
    }
}

/// What a laser without noise measures, metres.
fn ranges(laser: &LaserModel, map: &StaticMap, robot: Pose2, people: &Bodies) -> Vec<f64> {
    let map_from_laser = robot.compose(laser.robot_from_laser);
    let rays = Rays::new(map, map_from_laser.position());
    let (s, c) = sin_cos(map_from_laser.heading);
    let directions: Vec<(f64, f64)> = (0..laser.beams).map(|beam| direction(laser, beam)).collect();
    let mut ranges: Vec<f64> =
        directions.iter().map(|(x, y)| rays.range((c * x - s * y, s * x + c * y), laser.range_max)).collect();
    for &centre in &people.centres {
        let centre = map_from_laser.inverse_transform(centre);
        shorten(laser, &directions, &mut ranges, centre, people.radius);
    }
    ranges
}

/// The unit vector of a beam, laser frame.
fn direction(laser: &LaserModel, beam: u32) -> (f64, f64) {
    let (s, c) = sin_cos(laser.bearing(beam));
    (c, s)
}

/// Shortens the beams that meet a disc, laser frame. Only beams inside the angle that the disc subtends
/// are looked at.
fn shorten(laser: &LaserModel, directions: &[(f64, f64)], ranges: &mut [f64], centre: Point2, radius: f64) {
    let distance = centre.distance(Point2::default());
    if distance - radius >= laser.range_max {
        return;
    }
    let half = if distance > radius {
        atan2(radius, (distance * distance - radius * radius).sqrt())
    } else {
        std::f64::consts::PI
    };
    let gap = laser.bearing(1) - laser.bearing(0);
    let middle = (atan2(centre.y, centre.x) - laser.bearing(0)) / gap;
    let half = half / gap + 1.0;
    let turn = std::f64::consts::TAU / gap;
    for middle in [middle - turn, middle, middle + turn] {
        // Casts saturate: a window outside the field of view is empty.
        let first = (middle - half).ceil().max(0.0) as usize;
        let last = (middle + half).floor();
        let count = if last < 0.0 { 0 } else { (last as usize + 1).saturating_sub(first) };
        let window = ranges.iter_mut().zip(directions).skip(first).take(count);
        window.for_each(|(range, &direction)| *range = range.min(disc_range(centre, radius, direction)));
    }
}

/// Rays from one point against the occupied cells of a map.
pub(crate) struct Rays<'a> {
    caster: RayCaster<'a>,
    resolution: f64,
    /// Origin in cell units.
    origin: (f64, f64),
    /// Cosine and sine of the turn from the map frame into the grid's axes.
    turn: (f64, f64),
}

impl<'a> Rays<'a> {
    /// Rays from `origin`, map frame.
    pub(crate) fn new(map: &'a StaticMap, origin: Point2) -> Self {
        let grid = &map.grid;
        let (s, c) = sin_cos(-grid.origin().heading);
        Self {
            caster: RayCaster::new(map),
            resolution: grid.resolution(),
            origin: grid.grid_from_map(origin),
            turn: (c, s),
        }
    }

    /// Distance along the unit vector `direction` (map frame) to the first occupied cell, metres;
    /// `range_max` when there is none before. Unknown space is transparent, and nothing is outside.
    pub(crate) fn range(&self, direction: (f64, f64), range_max: f64) -> f64 {
        let (c, s) = self.turn;
        let dx = c * direction.0 - s * direction.1;
        let dy = s * direction.0 + c * direction.1;
        let reach = range_max * (1.0 / self.resolution);
        let range = self.caster.range(self.origin, (dx, dy), reach);
        range.map_or(range_max, |range| range * self.resolution)
    }
}

/// Distance along the unit vector `direction` from the origin to a disc; 0 inside it, infinite past it.
pub(crate) fn disc_range(centre: Point2, radius: f64, direction: (f64, f64)) -> f64 {
    let along = centre.x * direction.0 + centre.y * direction.1;
    let excess = centre.x * centre.x + centre.y * centre.y - radius * radius;
    if excess <= 0.0 {
        return 0.0;
    }
    let inside = along * along - excess;
    if along <= 0.0 || inside < 0.0 { f64::INFINITY } else { along - inside.sqrt() }
}

#[cfg(test)]
mod tests {
    use curionav_planning::occupancy::{Cell, OccupancyGrid};
    use curionav_planning::random::{rng, uniform};

    use super::*;

    fn no_people() -> Bodies {
        Bodies { centres: Vec::new(), radius: 0.25 }
    }

    /// Entry of a ray into the unit square at (column, row), by slabs.
    fn into_cell(o: (f64, f64), d: (f64, f64), column: f64, row: f64) -> f64 {
        let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
        for (o, d, from) in [(o.0, d.0, column), (o.1, d.1, row)] {
            let (a, b) = ((from - o) / d, (from + 1.0 - o) / d);
            enter = enter.max(a.min(b));
            leave = leave.min(a.max(b));
        }
        if enter <= leave { enter } else { f64::INFINITY }
    }

    #[test]
    fn rays_equal_the_nearest_of_all_cells() {
        for seed in 0..30 {
            let mut r = rng(seed, 0);
            let share = 0.05 * uniform(&mut r);
            let cells = (0..6000).map(|_| if uniform(&mut r) < share { 100 } else { 0 }).collect();
            let origin = Pose2::new(-2.0, 1.0, 0.7 * seed as f64);
            let map = StaticMap::new(OccupancyGrid::new(100, 60, 0.05, origin, cells).unwrap());
            for _ in 0..100 {
                let cell_point = (100.0 * uniform(&mut r), 60.0 * uniform(&mut r));
                let from = origin.transform(Point2::new(0.05 * cell_point.0, 0.05 * cell_point.1));
                let (s, c) = sin_cos(std::f64::consts::TAU * uniform(&mut r));
                let (ts, tc) = sin_cos(-origin.heading);
                let in_grid = (tc * c - ts * s, ts * c + tc * s);
                let expected = (0..6000)
                    .filter(|&i| map.grid.cell(i) == Cell::Occupied)
                    .map(|i| 0.05 * into_cell(cell_point, in_grid, (i % 100) as f64, (i / 100) as f64))
                    .fold(2.5, f64::min);
                let found = Rays::new(&map, from).range((c, s), 2.5);
                assert!((found - expected).abs() < 1e-6, "seed {seed}: {found} vs {expected}");
            }
        }
    }

    #[test]
    fn a_person_in_front_shortens_the_beam_to_its_skin() {
        let map =
            StaticMap::new(OccupancyGrid::new(100, 100, 0.1, Pose2::default(), vec![0; 10_000]).unwrap());
        let robot = Pose2::new(5.0, 5.0, std::f64::consts::FRAC_PI_2);
        let people = Bodies { centres: vec![Point2::new(5.0, 7.0)], radius: 0.25 };
        let ranges = ranges(&LaserModel::default(), &map, robot, &people);
        assert!((ranges[90] - 1.75).abs() < 1e-9); // 2 m to the centre less the radius
        // the disc subtends asin(0.25 / 2) = 7.18 degrees on either side: beams 83 to 97 of one degree
        let hit: Vec<usize> = (0..181).filter(|&i| ranges[i] < 5.0).collect();
        assert_eq!((hit[0], *hit.last().unwrap()), (83, 97));
    }

    #[test]
    fn every_beam_ends_on_the_nearest_of_all_people() {
        let map = StaticMap::new(OccupancyGrid::new(10, 10, 1.0, Pose2::default(), vec![0; 100]).unwrap());
        for seed in 0..60 {
            let mut r = rng(seed, 0);
            let n = 20;
            let mut any = |from: f64, to: f64| -> Vec<f64> {
                (0..n).map(|_| from + (to - from) * uniform(&mut r)).collect()
            };
            let (x, y) = (any(0.0, 10.0), any(0.0, 10.0));
            let centres = x.into_iter().zip(y).map(|(x, y)| Point2::new(x, y)).collect();
            let people = Bodies { centres, radius: 0.25 };
            let fov = [1.0, std::f64::consts::PI, 5.5, std::f64::consts::TAU][seed as usize % 4];
            let laser = LaserModel { fov, beams: 91, ..LaserModel::default() };
            let robot = Pose2::new(5.0, 5.0, 0.4 * seed as f64);
            for (i, range) in ranges(&laser, &map, robot, &people).into_iter().enumerate() {
                let nearest = (0..n)
                    .map(|k| robot.inverse_transform(people.centres[k]))
                    .map(|p| disc_range(p, 0.25, direction(&laser, i as u32)))
                    .fold(5.0, f64::min);
                assert!((range - nearest).abs() < 1e-9, "seed {seed}, beam {i}");
            }
        }
    }

    #[test]
    fn noise_has_the_models_sigma_and_misses_stay_at_the_limit() {
        let mut cells = vec![0; 10_000];
        (0..100).for_each(|row| cells[row * 100 + 80] = 100);
        let map = StaticMap::new(OccupancyGrid::new(100, 100, 0.1, Pose2::default(), cells).unwrap());
        let laser = LaserModel { beams: 3, ..LaserModel::default() };
        let mut r = rng(5, 0);
        let robot = Pose2::new(5.0, 5.0, 0.0);
        let mut sum = 0.0;
        for _ in 0..4000 {
            let scan = scan(&laser, &map, robot, &no_people(), &mut r);
            assert_eq!((scan[0], scan[2]), (5.0, 5.0)); // along the wall: nothing within 5 m
            sum += (f64::from(scan[1]) - 3.0).powi(2); // the wall's face is at x = 8
        }
        assert!(((sum / 4000.0).sqrt() - 0.03).abs() < 0.002);
    }
}
