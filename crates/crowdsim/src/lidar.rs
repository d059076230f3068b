//! The laser as it really measures: rays against walls, people and things, with noise.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::random::{Rng, standard_normal, uniform};
use curionav_planning::scene::People;
use curionav_planning::sensor::LaserModel;

use crate::beams::{Beams, Rays, disc_range};
use crate::things::Things;

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

/// One scan of a laser as it should be, from the robot's true pose, where there are walls and people alone.
pub fn scan(laser: &LaserModel, map: &StaticMap, robot: Pose2, people: &Bodies, rng: &mut Rng) -> Vec<f32> {
    let things = Things::new(&[]);
    let at = robot.compose(laser.robot_from_laser);
    let view = View { laser, at, walls: map, people, things: &things };
    let mut glass = rng.clone();
    view.scan(laser.range_sigma, rng, &mut glass)
}

/// What a laser looks at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct View<'a> {
    pub(crate) laser: &'a LaserModel,
    /// Where it is, map frame.
    pub(crate) at: Pose2,
    pub(crate) walls: &'a StaticMap,
    pub(crate) people: &'a Bodies,
    pub(crate) things: &'a Things,
}

impl View<'_> {
    /// One scan: a range for each beam, metres, `range_max` where nothing is met, with noise of `sigma` metres. One
    /// normal number is drawn for each beam, hit or not, so that the noise of a beam does not depend on what the others
    /// see. `glass` draws which beams pass through glass.
    pub(crate) fn scan(&self, sigma: f64, noise: &mut Rng, glass: &mut Rng) -> Vec<f32> {
        let range_max = self.laser.range_max;
        let noisy = self.ranges(glass).into_iter().map(|range| {
            let error = sigma * standard_normal(noise);
            (if range < range_max { (range + error).clamp(0.0, range_max) } else { range_max }) as f32
        });
        noisy.collect()
    }

    /// What a laser without noise measures, metres.
    fn ranges(&self, glass: &mut Rng) -> Vec<f64> {
        let Self { laser, at, .. } = *self;
        let rays = Rays::new(self.walls, at.position());
        let (s, c) = sin_cos(at.heading);
        let mut beams = Beams::new(laser);
        beams.cast(|(x, y)| rays.range((c * x - s * y, s * x + c * y), laser.range_max));
        let radius = self.people.radius;
        for &centre in &self.people.centres {
            let centre = at.inverse_transform(centre);
            beams.shorten(centre, radius, |_, direction| disc_range(centre, radius, direction));
        }
        self.things.shorten(&mut beams, at, glass);
        beams.into_ranges()
    }
}

/// Makes each beam say nothing by this chance, whatever the others do.
pub fn silence(ranges: &mut [f32], share: f64, rng: &mut Rng) {
    for range in ranges {
        if uniform(rng) < share {
            *range = f32::NAN;
        }
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::occupancy::{Cell, OccupancyGrid};
    use curionav_planning::random::{rng, uniform};

    use super::*;
    use crate::beams::direction;

    fn ranges(laser: &LaserModel, map: &StaticMap, robot: Pose2, people: &Bodies) -> Vec<f64> {
        let things = Things::new(&[]);
        let at = robot.compose(laser.robot_from_laser);
        View { laser, at, walls: map, people, things: &things }.ranges(&mut rng(0, 0))
    }

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
