//! Laying a scan on the map: where the robot is according to belief and scan together.
//!
//! The belief of a localiser is wide, because it has to be right about many scans in a row. To tell people from walls,
//! what counts is how well one scan fits the map, which is far better known: the walls in a scan are all off by the
//! same error of the pose. A few steps of Gauss and Newton, with what is expected as prior and a loss that takes no
//! notice of beams that end far from walls, find the pose that fits, and how well it is determined in each direction.

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::occupancy::StaticMap;
use nalgebra::{Matrix3, Vector3};

use crate::background::Posed;

/// Steps of Gauss and Newton.
const STEPS: usize = 5;
/// Most beams that are looked at, evenly spaced.
const MOST_BEAMS: usize = 180;
/// Neighbouring beams share the map's errors: so many of them say as much as one.
const CORRELATION: f64 = 4.0;
/// Errors of so many standard deviations count half and larger ones soon nothing.
const SCALE: f64 = 2.0;
/// Beams whose error is larger than the scale by the root of this end on something else. Without this limit many people
/// would pull the robot along where no wall holds it.
const CUT: f64 = 3.0;
/// Beams whose ends are known no better than this say nothing, m2: they may belong to another wall.
const LINEAR: f64 = 0.25;
/// Added to the belief's variances, m2 and rad2: a prior that is certain could not be inverted.
const LEAST_VARIANCE: f64 = 1e-6;

/// The pose that fits `ends`, robot frame, and its covariance, given what is believed. `sigma` is the standard
/// deviation of a beam's end around a wall, metres.
pub(crate) fn align(
    map: &StaticMap,
    ends: &[Point2],
    sigma: f64,
    believed: Pose2,
    covariance: &Matrix3<f64>,
) -> (Pose2, Matrix3<f64>) {
    let Some(prior) = (covariance + Matrix3::identity() * LEAST_VARIANCE).try_inverse() else {
        return (believed, *covariance);
    };
    let stride = ends.len().div_ceil(MOST_BEAMS).max(1);
    let mut pose = believed;
    let mut found = *covariance;
    for _ in 0..STEPS {
        let posed = Posed::new(map, pose);
        let off = Vector3::new(pose.x - believed.x, pose.y - believed.y, pose.heading - believed.heading);
        let mut information = prior;
        let mut pull = -(prior * off);
        for end in ends.iter().step_by(stride) {
            let wall = posed.to_wall(*end);
            // At first the whole belief may be off, later what is left of it.
            let spread = sigma * sigma + wall.variance(&found);
            let size = wall.metres * wall.metres / (SCALE * SCALE * spread);
            if size > CUT || wall.variance(covariance) > LINEAR {
                continue;
            }
            let weight = 1.0 / (CORRELATION * sigma * sigma * (1.0 + size) * (1.0 + size));
            information += wall.slope * wall.slope.transpose() * weight;
            pull -= wall.slope * (weight * wall.metres);
        }
        let Some(inverse) = information.try_inverse() else { break };
        let change = inverse * pull;
        found = inverse;
        pose = Pose2::new(pose.x + change.x, pose.y + change.y, pose.heading + change.z);
        if change.norm() < 1e-4 {
            break;
        }
    }
    (pose, (found + found.transpose()) * 0.5)
}
