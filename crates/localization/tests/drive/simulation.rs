//! A simulated robot on a grid map, for these tests only: ray caster, plant, odometry, path follower.

use std::path::PathBuf;

use curionav_localization::{Estimate, Localizer, LocalizerParams, Scan};
use curionav_planning::geometry::{Point2, Pose2, Twist, bearing, wrap_angle};
use curionav_planning::motion::{OdometryNoise, step};
use curionav_planning::numerics::sin_cos;
use curionav_planning::occupancy::{Cell, GeodesicField, OccupancyGrid, StaticMap};
use curionav_planning::random::{Rng, rng, standard_normal, uniform};
use curionav_planning::sensor::LaserModel;
use nalgebra::{Matrix3, Vector3};

/// 0.2 m standard deviation per 10 m, 5 degrees per full turn, little drift of heading on the straight.
pub(crate) const NOISE: OdometryNoise = OdometryNoise {
    position_per_metre: 0.004,
    position_per_radian: 0.0001,
    heading_per_metre: 0.0002,
    heading_per_radian: 0.00121,
};

pub(crate) const DT: f64 = 0.1;

/// The real map, if the data set is there.
pub(crate) fn real_map() -> Option<StaticMap> {
    let data = std::env::var("CURIONAV_DATA").map_or_else(
        |_| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../../shared/data")),
        PathBuf::from,
    );
    let file = data.join("maps_real_slam/avz3floor_complete.pgm");
    let Ok(bytes) = std::fs::read(&file) else {
        println!("skipped: no map at {}", file.display());
        return None;
    };
    // origin and resolution as in the yaml beside it
    Some(StaticMap::new(load_pgm(&bytes, 0.05, Pose2::new(-66.0, -12.5, 0.0))))
}

/// P5 with comments; the first row is the top one. Thresholds 0.65 and 0.196 on (255 - v) / 255.
fn load_pgm(bytes: &[u8], resolution: f64, origin: Pose2) -> OccupancyGrid {
    let mut at = 0;
    let mut words = Vec::new();
    while words.len() < 4 {
        if bytes[at] == b'#' {
            at += bytes[at..].iter().position(|&b| b == b'\n').unwrap();
        } else if bytes[at].is_ascii_whitespace() {
            at += 1;
        } else {
            let end = at + bytes[at..].iter().position(u8::is_ascii_whitespace).unwrap();
            words.push(std::str::from_utf8(&bytes[at..end]).unwrap().to_owned());
            at = end;
        }
    }
    assert_eq!(words[0], "P5");
    let (width, height): (usize, usize) = (words[1].parse().unwrap(), words[2].parse().unwrap());
    let pixels = &bytes[at + 1..at + 1 + width * height];
    let value = |v: u8| match f64::from(255 - v) / 255.0 {
        o if o > 0.65 => 100,
        o if o < 0.196 => 0,
        _ => -1,
    };
    let cells = pixels.chunks_exact(width).rev().flatten().map(|&v| value(v)).collect();
    OccupancyGrid::new(width, height, resolution, origin, cells).unwrap()
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

pub(crate) struct Robot<'a> {
    pub(crate) map: &'a StaticMap,
    pub(crate) laser: LaserModel,
    pub(crate) truth: Pose2,
    pub(crate) odometry: Pose2,
    pub(crate) twist: Twist,
    pub(crate) stamp: f64,
    /// Share of the beams cut short by people, in runs of neighbouring beams.
    pub(crate) blocked: f64,
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
            random: rng(seed, 900),
            ranges: Vec::new(),
        }
    }

    /// Drives one step; the odometry's increment differs from the true one by the noise.
    pub(crate) fn drive(&mut self, twist: Twist) {
        let before = self.truth;
        self.truth = step(self.truth, twist, DT);
        let moved = before.relative(self.truth);
        let variances = NOISE.variances(twist.v * DT, twist.omega * DT);
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
            let free = cast(
                &self.map.grid,
                sensor.position(),
                sensor.heading + self.laser.bearing(i),
                self.laser.range_max,
            );
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

/// Figures of one run.
#[derive(Debug, Default)]
pub(crate) struct Record {
    pub(crate) position_error: Vec<f64>,
    pub(crate) nees: Vec<f64>,
    pub(crate) estimates: Vec<Estimate>,
}

impl Record {
    pub(crate) fn push(&mut self, truth: Pose2, estimate: Estimate) {
        self.position_error.push(truth.position().distance(estimate.pose.position()));
        self.nees.push(nees(truth, &estimate));
        self.estimates.push(estimate);
    }

    pub(crate) fn rmse(&self) -> f64 {
        (self.position_error.iter().map(|e| e * e).sum::<f64>() / self.position_error.len() as f64).sqrt()
    }

    pub(crate) fn mean(&self, value: impl Fn(&Estimate) -> f64) -> f64 {
        self.estimates.iter().map(value).sum::<f64>() / self.estimates.len() as f64
    }

    pub(crate) fn mean_nees(&self) -> f64 {
        self.nees.iter().sum::<f64>() / self.nees.len() as f64
    }
}

/// Normalised estimation error squared, three degrees of freedom.
pub(crate) fn nees(truth: Pose2, estimate: &Estimate) -> f64 {
    let e = Vector3::new(
        truth.x - estimate.pose.x,
        truth.y - estimate.pose.y,
        wrap_angle(truth.heading - estimate.pose.heading),
    );
    (e.transpose() * estimate.covariance.try_inverse().unwrap_or_else(Matrix3::identity) * e)[0]
}

/// A way of about `length` metres through the map's free space, 0.5 m clear of obstacles at both ends.
pub(crate) fn long_path(map: &StaticMap, length: f64) -> Vec<Point2> {
    let grid = &map.grid;
    let roomy: Vec<usize> = (0..grid.width() * grid.height())
        .filter(|&i| grid.cell(i) == Cell::Free && map.to_obstacle.cell(i) > 0.6)
        .collect();
    let centre = |i: usize| grid.centre(i % grid.width(), i / grid.width());
    let mut best = (f64::INFINITY, Vec::new());
    for k in 0..5 {
        let goal = centre(roomy[roomy.len() * (2 * k + 1) / 10]);
        let field = GeodesicField::new(grid, &map.to_obstacle, goal, 0.4);
        for &i in roomy.iter().step_by(97) {
            let off = (field.cell(i) - 1.1 * length).abs();
            if off < best.0 {
                best = (off, field.descend(grid, centre(i), 0.1));
            }
        }
        if best.0 < 1.0 {
            break;
        }
    }
    best.1
}

/// Follows the path by pure pursuit with the true pose; `each` is called with the robot at every tick.
pub(crate) fn follow(robot: &mut Robot, path: &[Point2], mut each: impl FnMut(&mut Robot)) {
    let mut target = 0;
    while target < path.len() {
        while target < path.len() && path[target].distance(robot.truth.position()) < 0.6 {
            target += 1;
        }
        let Some(&ahead) = path.get(target) else { break };
        let off = wrap_angle(bearing(robot.truth.position(), ahead) - robot.truth.heading);
        let v = if off.abs() > 0.8 { 0.1 } else { 0.8 };
        robot.drive(Twist { v, omega: (2.0 * off).clamp(-1.0, 1.0) });
        each(robot);
    }
}

/// The start pose of a path.
pub(crate) fn start_of(path: &[Point2]) -> Pose2 {
    let heading = bearing(path[0], path[8.min(path.len() - 1)]);
    Pose2::new(path[0].x, path[0].y, heading)
}

/// Nominal start plus noise of half the filter's start deviation, cut at 2 sigma (D8).
pub(crate) fn nominal_start(truth: Pose2, params: &LocalizerParams, seed: u64) -> Pose2 {
    let mut random = rng(seed, 901);
    let mut draw = |sigma: f64| 0.5 * sigma * standard_normal(&mut random).clamp(-2.0, 2.0);
    Pose2::new(
        truth.x + draw(params.start_sigma_position),
        truth.y + draw(params.start_sigma_position),
        wrap_angle(truth.heading + draw(params.start_sigma_heading)),
    )
}

/// A localizer told the nominal start.
pub(crate) fn started(map: &StaticMap, truth: Pose2, params: &LocalizerParams, seed: u64) -> Localizer {
    let mut localizer =
        Localizer::new(map.clone(), LaserModel::default(), NOISE, params.clone(), seed).unwrap();
    let covariance = localizer.start_covariance();
    localizer.initialise(nominal_start(truth, params, seed), &covariance);
    localizer
}

/// Drives the whole path with one localizer.
pub(crate) fn drive_path(
    map: &StaticMap,
    path: &[Point2],
    params: &LocalizerParams,
    blocked: f64,
    seed: u64,
) -> Record {
    let start = start_of(path);
    let mut robot = Robot::new(map, start, seed);
    robot.blocked = blocked;
    let mut localizer = started(map, start, params, seed);
    let mut record = Record::default();
    follow(&mut robot, path, |robot| {
        let estimate = robot.tick(&mut localizer);
        record.push(robot.truth, estimate);
    });
    record
}
