//! Ways through a map, runs along them, and the figures of a run.

use curionav_localization::{Estimate, Localizer, LocalizerParams};
use curionav_planning::geometry::{Point2, Pose2, Twist, bearing, wrap_angle};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::occupancy::{Cell, GeodesicField, StaticMap};
use curionav_planning::random::{rng, standard_normal};
use curionav_planning::sensor::LaserModel;
use nalgebra::{Matrix3, Vector3};

use crate::simulation::Robot;

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
        let field = GeodesicField::new(map, goal, 0.4);
        for &i in roomy.iter().step_by(97) {
            let off = (field.at(centre(i)) - 1.1 * length).abs();
            if off < best.0 {
                best = (off, field.descend(centre(i), 0.1));
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

/// A localizer told nothing.
pub(crate) fn untold(map: &StaticMap, params: &LocalizerParams, seed: u64) -> Localizer {
    Localizer::new(map.clone(), LaserModel::default(), OdometryNoise::default(), params.clone(), seed)
        .unwrap()
}

/// A localizer told the nominal start.
pub(crate) fn started(map: &StaticMap, truth: Pose2, params: &LocalizerParams, seed: u64) -> Localizer {
    let mut localizer = untold(map, params, seed);
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
