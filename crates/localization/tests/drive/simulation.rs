//! A simulated robot on a grid map, for these tests only: ray caster, plant, odometry, path follower.

use curionav_localization::{Estimate, Localizer, Scan};
use curionav_planning::geometry::{Point2, Pose2, Twist, wrap_angle};
use curionav_planning::motion::{OdometryNoise, step};
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::{Cell, MapYaml, OccupancyGrid, StaticMap, load_map};
use curionav_planning::random::{Rng, rng, standard_normal, uniform};
use curionav_planning::sensor::LaserModel;
use curionav_testing::reference_data;
use nalgebra::{Matrix3, Vector3};

pub(crate) const DT: f64 = 0.1;

/// The real map, if the dataset is there.
#[track_caller]
pub(crate) fn real_map() -> Option<StaticMap> {
    let path = reference_data("maps_real_slam/avz3floor_complete.yaml")?;
    let yaml = MapYaml::parse(&std::fs::read_to_string(&path).unwrap()).unwrap();
    let image = std::fs::read(path.with_file_name(&yaml.image)).unwrap();
    Some(StaticMap::new(load_map(&yaml, &image).unwrap()))
}

/// A hall of `width` x `height` metres at 0.05 m with solid walls and the given solid boxes
/// (x0, y0, x1, y1).
pub(crate) fn hall(width: f64, height: f64, boxes: &[(f64, f64, f64, f64)]) -> StaticMap {
    let (columns, rows) = ((width / 0.05) as usize, (height / 0.05) as usize);
    let cells = (0..columns * rows)
        .map(|i| {
            let (c, r) = (i % columns, i / columns);
            let (x, y) = ((c as f64 + 0.5) * 0.05, (r as f64 + 0.5) * 0.05);
            let rim = c < 2 || r < 2 || c + 2 >= columns || r + 2 >= rows;
            let solid = boxes.iter().any(|b| x >= b.0 && x <= b.2 && y >= b.1 && y <= b.3);
            if rim || solid { 100 } else { 0 }
        })
        .collect();
    StaticMap::new(OccupancyGrid::new(columns, rows, 0.05, Pose2::default(), cells).unwrap())
}

/// Distance along a ray to the first occupied cell's side (Amanatides and Woo, 1987), at most `limit`.
pub(crate) fn cast(grid: &OccupancyGrid, from: Point2, angle: f64, limit: f64) -> f64 {
    let (x, y) = grid.grid_from_map(from);
    let (s, c) = sin_cos(angle - grid.origin().heading);
    let (mut column, mut row) = (x.floor() as i64, y.floor() as i64);
    let (dx, dy) = (if c > 0.0 { 1 } else { -1 }, if s > 0.0 { 1 } else { -1 });
    let side = |cell: i64, d: i64| (cell + i64::from(d > 0)) as f64;
    let crossing =
        |at: f64, to: f64, speed: f64| if speed == 0.0 { f64::INFINITY } else { (to - at) / speed };
    let (mut next_x, mut next_y) = (crossing(x, side(column, dx), c), crossing(y, side(row, dy), s));
    let mut travelled = 0.0;
    while travelled * grid.resolution() < limit {
        if column < 0 || row < 0 || column >= grid.width() as i64 || row >= grid.height() as i64 {
            return limit;
        }
        if grid.cell(grid.index(column as usize, row as usize)) == Cell::Occupied {
            return travelled * grid.resolution();
        }
        if next_x < next_y {
            travelled = next_x;
            column += dx;
            next_x = crossing(x, side(column, dx), c);
        } else {
            travelled = next_y;
            row += dy;
            next_y = crossing(y, side(row, dy), s);
        }
    }
    limit
}

/// Radius of a person who stands, metres.
pub(crate) const PERSON: f64 = 0.25;

/// Distance along a ray to a person, if it meets one.
fn to_person(from: Point2, angle: f64, person: Point2) -> Option<f64> {
    let (s, c) = sin_cos(angle);
    let (dx, dy) = (person.x - from.x, person.y - from.y);
    let (along, off) = (c * dx + s * dy, c * dy - s * dx);
    (along > 0.0 && off.abs() < PERSON).then(|| along - (PERSON * PERSON - off * off).sqrt())
}

pub(crate) struct Robot<'a> {
    pub(crate) map: &'a StaticMap,
    pub(crate) laser: LaserModel,
    pub(crate) truth: Pose2,
    pub(crate) odometry: Pose2,
    pub(crate) twist: Twist,
    pub(crate) stamp: f64,
    /// Share of the beams cut short by people, in runs of neighbouring beams.
    pub(crate) blocked: f64,
    /// People who stand: discs of [`PERSON`].
    pub(crate) people: Vec<Point2>,
    random: Rng,
    ranges: Vec<f32>,
}

impl<'a> Robot<'a> {
    pub(crate) fn new(map: &'a StaticMap, start: Pose2, seed: u64) -> Self {
        Self {
            map,
            laser: LaserModel::default(),
            truth: start,
            odometry: Pose2::default(),
            twist: Twist::default(),
            stamp: 0.0,
            blocked: 0.0,
            people: Vec::new(),
            random: rng(seed, 900),
            ranges: Vec::new(),
        }
    }

    /// A deviation of this covariance.
    pub(crate) fn drawn(&mut self, covariance: &Matrix3<f64>) -> Vector3<f64> {
        let root = covariance.cholesky().unwrap().l();
        root * Vector3::from_fn(|_, _| standard_normal(&mut self.random))
    }

    /// Drives one step; the odometry's increment differs from the true one by the noise.
    pub(crate) fn drive(&mut self, twist: Twist) {
        let before = self.truth;
        self.truth = step(self.truth, twist, DT);
        let moved = before.relative(self.truth);
        let variances = OdometryNoise::default().variances(twist.v * DT, twist.omega * DT);
        let noise: Vec<f64> =
            variances.iter().map(|v| v.sqrt() * standard_normal(&mut self.random)).collect();
        let measured =
            Pose2::new(moved.x + noise[0], moved.y + noise[1], wrap_angle(moved.heading + noise[2]));
        self.odometry = self.odometry.compose(measured);
        self.twist = twist;
        self.stamp += DT;
    }

    /// A sweep from where the robot is.
    pub(crate) fn scan(&mut self) -> Scan<'_> {
        self.ranges.clear();
        let sensor = self.truth.compose(self.laser.robot_from_laser);
        // People stand in blocks of ten beams; a block is cut to 0.5..1.5 m with the given probability.
        let mut person = None;
        for i in 0..self.laser.beams {
            if i % 10 == 0 {
                person = (uniform(&mut self.random) < self.blocked).then(|| 0.5 + uniform(&mut self.random));
            }
            let angle = sensor.heading + self.laser.bearing(i);
            let wall = cast(&self.map.grid, sensor.position(), angle, self.laser.range_max);
            let met = self.people.iter().filter_map(|person| to_person(sensor.position(), angle, *person));
            let free = met.fold(wall, f64::min);
            let hit = person.map_or(free, |p: f64| p.min(free));
            let range = if hit >= self.laser.range_max {
                self.laser.range_max
            } else {
                (hit + self.laser.range_sigma * standard_normal(&mut self.random))
                    .clamp(0.01, self.laser.range_max)
            };
            self.ranges.push(range as f32);
        }
        Scan { ranges: &self.ranges, laser: self.laser }
    }

    pub(crate) fn tick(&mut self, localizer: &mut Localizer) -> Estimate {
        let (odometry, twist, stamp) = (self.odometry, self.twist, self.stamp);
        localizer.update(odometry, twist, stamp, &self.scan())
    }
}
