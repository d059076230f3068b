//! The estimate moved to where the newest scan fits the map best: scan matching by Gauss and Newton on the distance to
//! the nearest surface (Kohlbrecher and others, "A flexible and scalable SLAM system with full 3D motion estimation",
//! 2011, for a map that is known).
//!
//! A cloud of some hundred particles errs by several centimetres however sharp its scans are, and a door leaves a robot
//! less than that. The particles stay as they are: this is what is said of them, not what they are.

use nalgebra::{Matrix3, Vector3};

use curionav_planning::beam::Beam;
use curionav_planning::geometry::{Direction, Point2, Pose2, wrap_angle};
use curionav_planning::occupancy::StaticMap;
use curionav_planning::sensor::LaserModel;

use crate::scan::Scan;
use crate::surfaces::Surfaces;

/// Most beams that take part, evenly spaced: more say the same.
const BEAMS_MAX: usize = 200;
/// Steps of the search: it has settled after four or five.
const STEPS: usize = 8;
/// Deviation of a beam's end from a surface, metres: the laser's noise and the cells of the map.
const SIGMA_M: f64 = 0.05;
/// Distance at which a beam counts a quarter: it may have met a person or a thing (Geman and McClure). The first step
/// has a greater one, and each has half of the one before, so that none ends where it began.
const SCALE_M: f64 = 0.1;
/// See [`SCALE_M`].
const FIRST_SCALE_M: f64 = 0.4;
/// The distance of a beam's end is taken as far before it, metres, and carried on along the beam: a wall may be thinner
/// than a beam is noisy, and has another surface behind the one that was met.
const BEFORE_M: f64 = 0.15;
/// Beams that end within this distance of a surface fit, metres.
const FITS_M: f64 = 0.15;
/// At least this share of the beams that meet something has to fit: otherwise the robot is in a crowd, or elsewhere.
const SHARE_MIN: f64 = 0.5;
/// And at least so many of them.
const FITTING_MIN: usize = 10;
/// The estimate is moved by no more than so many standard deviations, squared.
const MOVED_MAX: f64 = 9.0;

/// The end of a beam, robot frame.
#[derive(Clone, Copy)]
struct End {
    at: Point2,
    /// Direction of the beam.
    along: Point2,
}

/// How well a pose fits a scan.
struct Fit {
    /// Of the squared error, in its own units: a system of equations for the next step.
    matrix: Matrix3<f64>,
    gradient: Vector3<f64>,
    /// The error itself.
    error: f64,
    /// Beams that end near a surface.
    fitting: usize,
}

/// A pose around another at which enough of a scan fits.
struct Found {
    pose: Pose2,
    /// Whether it fits better there than at the other.
    is_better: bool,
}

/// Finds where scans fit a map, whatever odometry says: to fit a robot's parameters to a log.
pub struct ScanMatcher(Surfaces);

/// Deviation of the pose that a match begins from, metres and radians: what a late laser makes of it.
const NEAR: Vector3<f64> = Vector3::new(0.15, 0.15, 0.1);

impl ScanMatcher {
    /// Of scans on this map.
    pub fn new(map: &StaticMap) -> Self {
        Self(Surfaces::new(map))
    }

    /// The pose around `pose`, map frame, at which the scan fits best; none where that is not clear.
    pub fn near(&self, pose: Pose2, scan: &Scan<'_>) -> Option<Pose2> {
        let covariance = Matrix3::from_diagonal(&NEAR.component_mul(&NEAR));
        let found = self.0.search(pose, &covariance, scan)?;
        Some(if found.is_better { found.pose } else { pose })
    }
}

impl Surfaces {
    /// The pose around `pose`, known with this covariance, at which `scan` fits the map best; none if too little of
    /// the scan fits, or if it fits no better.
    pub(crate) fn refined(&self, pose: Pose2, covariance: &Matrix3<f64>, scan: &Scan<'_>) -> Option<Pose2> {
        self.search(pose, covariance, scan).filter(|found| found.is_better).map(|found| found.pose)
    }

    fn search(&self, pose: Pose2, covariance: &Matrix3<f64>, scan: &Scan<'_>) -> Option<Found> {
        let ends = ends(scan);
        let information = covariance.try_inverse()?;
        let before = self.fit(pose, &ends, SCALE_M);
        let mut best = pose;
        let mut offset = Vector3::zeros();
        let mut scale = FIRST_SCALE_M;
        for _ in 0..STEPS {
            let fit = self.fit(best, &ends, scale);
            scale = (0.5 * scale).max(SCALE_M);
            let step = (fit.matrix + information).try_inverse()? * (fit.gradient + information * offset);
            offset -= step;
            best = Pose2::new(pose.x + offset.x, pose.y + offset.y, wrap_angle(pose.heading + offset.z));
        }
        let after = self.fit(best, &ends, SCALE_M);
        let enough = ((SHARE_MIN * ends.len() as f64) as usize).max(FITTING_MIN);
        let moved = (offset.transpose() * information * offset).x;
        let is_better = after.error + moved < before.error;
        (after.fitting >= enough && moved <= MOVED_MAX).then_some(Found { pose: best, is_better })
    }

    fn fit(&self, pose: Pose2, ends: &[End], scale: f64) -> Fit {
        let facing = Direction::of(pose.heading);
        let mut fit = Fit { matrix: Matrix3::zeros(), gradient: Vector3::zeros(), error: 0.0, fitting: 0 };
        for End { at, along } in ends {
            // From the robot, in the axes of the map.
            let end = turned(*at, facing);
            let along = turned(*along, facing);
            let before =
                Point2::new(pose.x + end.x - BEFORE_M * along.x, pose.y + end.y - BEFORE_M * along.y);
            let Some((metres, slope)) = self.at(before) else {
                fit.error += scale * scale / (SIGMA_M * SIGMA_M);
                continue;
            };
            let metres = metres + BEFORE_M * (slope.x * along.x + slope.y * along.y);
            let scaled = metres * metres / (scale * scale);
            let weight = 1.0 / ((1.0 + scaled) * (1.0 + scaled) * SIGMA_M * SIGMA_M);
            let change = Vector3::new(slope.x, slope.y, slope.y * end.x - slope.x * end.y);
            fit.matrix += weight * change * change.transpose();
            fit.gradient += weight * metres * change;
            fit.error += metres * metres / ((1.0 + scaled) * SIGMA_M * SIGMA_M);
            fit.fitting += usize::from(metres.abs() <= FITS_M);
        }
        fit
    }
}

/// The beams that meet something.
fn ends(scan: &Scan<'_>) -> Vec<End> {
    let Scan { ranges, laser } = scan;
    let available = ranges.len().min(laser.beams as usize);
    let every = available.div_ceil(BEAMS_MAX).max(1);
    (0..available).step_by(every).filter_map(|i| end(ranges[i], i as u32, laser)).collect()
}

/// Where the beam of this number ends; nowhere if it meets nothing.
fn end(range: f32, beam: u32, laser: &LaserModel) -> Option<End> {
    let Beam::Obstacle(metres) = Beam::of(range, 0.0, laser.range_max) else { return None };
    let Direction { cos, sin } = Direction::of(laser.robot_from_laser.heading + laser.bearing(beam));
    let from = laser.robot_from_laser.position();
    Some(End { at: Point2::new(from.x + metres * cos, from.y + metres * sin), along: Point2::new(cos, sin) })
}

/// A vector of the robot's frame in the axes of the map, for a robot that faces this way.
fn turned(of_robot: Point2, facing: Direction) -> Point2 {
    let Direction { cos, sin } = facing;
    Point2::new(cos * of_robot.x - sin * of_robot.y, sin * of_robot.x + cos * of_robot.y)
}

#[cfg(test)]
mod tests {
    use super::*;
    use curionav_planning::numerics::sin_cos;
    use curionav_planning::occupancy::{Cell, OccupancyGrid, StaticMap};
    use curionav_planning::random::{rng, standard_normal};

    /// 12 m x 8 m in cells of 0.05 m, turned by 0.3 rad: walls all around, and one with a gap.
    fn map() -> StaticMap {
        let cell = |i: usize| {
            let column = i % 240;
            let row = i / 240;
            let is_rim = column == 0 || row == 0 || column == 239 || row == 159;
            let is_wall = (120..124).contains(&column) && !(72..88).contains(&row);
            if is_rim || is_wall { 100 } else { 0 }
        };
        let cells = (0..240 * 160).map(cell).collect();
        StaticMap::new(OccupancyGrid::new(240, 160, 0.05, Pose2::new(1.0, -2.0, 0.3), cells).unwrap())
    }

    /// What a laser with 3 cm of noise sees from `pose`, the first `blocked` beams by something 0.5 m away.
    fn scan(map: &StaticMap, pose: Pose2, laser: &LaserModel, blocked: usize) -> Vec<f32> {
        let mut random = rng(7, 0);
        let range = |i: u32| {
            let (sin, cos) = sin_cos(pose.heading + laser.bearing(i));
            let on_way = (0..8000).map(|k| 0.001 * f64::from(k));
            let meets = |s: &f64| map.grid.at(Point2::new(pose.x + s * cos, pose.y + s * sin)) != Cell::Free;
            let metres = on_way.into_iter().find(meets).unwrap_or(laser.range_max);
            let noisy = metres + 0.03 * standard_normal(&mut random);
            if (i as usize) < blocked { 0.5 } else { noisy.min(laser.range_max) as f32 }
        };
        (0..laser.beams).map(range).collect()
    }

    #[test]
    fn an_estimate_off_by_a_hand_is_moved_to_a_centimetre_also_in_a_crowd() {
        let map = map();
        let surfaces = Surfaces::new(&map);
        let laser = LaserModel { range_max: 8.0, ..LaserModel::default() };
        let covariance = Matrix3::from_diagonal(&Vector3::new(0.0049, 0.0049, 0.0012));
        let truth = map.grid.origin().compose(Pose2::new(5.0, 4.0, 0.1));
        for blocked in [0, 70] {
            let ranges = scan(&map, truth, &laser, blocked);
            let scan = Scan { ranges: &ranges, laser };
            for (dx, dy, turn) in [(0.08, -0.05, 0.03), (-0.06, 0.09, -0.04), (0.0, 0.0, 0.0)] {
                let off = Pose2::new(truth.x + dx, truth.y + dy, truth.heading + turn);
                let found = surfaces.refined(off, &covariance, &scan).unwrap_or(off);
                let error = found.position().distance(truth.position());
                let turned = (found.heading - truth.heading).abs();
                assert!(error < 0.02 && turned < 0.01, "{blocked} {dx} {dy}: {error} m, {turned} rad");
            }
        }
    }

    #[test]
    fn a_scan_that_does_not_fit_moves_nothing() {
        let map = map();
        let surfaces = Surfaces::new(&map);
        let laser = LaserModel { range_max: 8.0, ..LaserModel::default() };
        let covariance = Matrix3::from_diagonal(&Vector3::new(0.0049, 0.0049, 0.0012));
        let truth = map.grid.origin().compose(Pose2::new(5.0, 4.0, 0.1));
        let crowded = scan(&map, truth, &laser, 140);
        let elsewhere = scan(&map, map.grid.origin().compose(Pose2::new(9.0, 2.0, 2.0)), &laser, 0);
        let silent = vec![f32::NAN; 181];
        for ranges in [crowded, elsewhere, silent] {
            assert_eq!(surfaces.refined(truth, &covariance, &Scan { ranges: &ranges, laser }), None);
        }
    }
}
