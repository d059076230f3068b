//! How the robot itself moves from scan to scan, by its odometry and by how the walls lie.
//!
//! A person who stands seems to walk where the robot is wrong about its own turn: a hundredth of a radian moves what is
//! 7 m off by 7 cm, and a scan later again. So people are followed on the map. Odometry says where the robot is to be
//! expected there, the walls in the scan correct it ([`crate::Detector::see`]), and where no wall tells anything
//! odometry stands. The belief of a localiser would not do in its place: its mean jumps.

use curionav_planning::geometry::{Point2, Pose2, wrap_angle};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::scene::Belief;
use nalgebra::{Matrix3, Vector3};

/// Greatest squared Mahalanobis distance between the pose and the belief: 99 % of errors in x, y and heading are
/// nearer.
const GATE: f64 = 11.34;

/// The robot on the map at the last scan.
#[derive(Debug, Clone, Copy)]
struct Placed {
    odometry: Pose2,
    pose: Pose2,
    covariance: Matrix3<f64>,
}

/// Where the robot is expected before the walls have been looked at.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Expected {
    pub(crate) pose: Pose2,
    pub(crate) covariance: Matrix3<f64>,
    /// Where its own motion has brought it, if the belief is taken instead.
    pub(crate) instead_of: Option<Pose2>,
}

/// Follows the robot over the map.
#[derive(Debug, Clone)]
pub(crate) struct EgoMotion {
    noise: OdometryNoise,
    last: Option<Placed>,
}

impl EgoMotion {
    pub(crate) fn new(noise: OdometryNoise) -> Self {
        Self { noise, last: None }
    }

    pub(crate) fn restart(&mut self) {
        self.last = None;
    }

    /// Where the robot is by what it has moved since the last scan. Where the belief says it is at the beginning, if
    /// both do not agree, and if the belief knows it better.
    pub(crate) fn expect(&self, odometry: Pose2, belief: &Belief) -> Expected {
        let believed = Expected { pose: belief.pose, covariance: belief.covariance, instead_of: None };
        let Some(last) = self.last else { return believed };
        let motion = last.odometry.relative(odometry);
        let pose = last.pose.compose(motion);
        let displacement = Point2::new(pose.x - last.pose.x, pose.y - last.pose.y);
        let travel = motion.position().distance(Point2::default());
        let covariance = self.noise.propagate(&last.covariance, displacement, travel, motion.heading);
        let turned = wrap_angle(pose.heading - belief.pose.heading);
        let off = Vector3::new(pose.x - belief.pose.x, pose.y - belief.pose.y, turned);
        let known_better = covariance.trace() <= belief.covariance.trace();
        let inverse = (covariance + belief.covariance).try_inverse().filter(|_| known_better);
        if inverse.is_some_and(|inverse| (off.transpose() * inverse * off)[(0, 0)] <= GATE) {
            Expected { pose, covariance, instead_of: None }
        } else {
            Expected { instead_of: Some(pose), ..believed }
        }
    }

    /// Takes note of where the walls have shown the robot to be.
    pub(crate) fn settle(&mut self, odometry: Pose2, pose: Pose2, covariance: Matrix3<f64>) {
        self.last = Some(Placed { odometry, pose, covariance });
    }
}

#[cfg(test)]
mod tests {
    use curionav_planning::geometry::Twist;

    use super::*;

    fn belief(x: f64, variance: f64) -> Belief {
        let (pose, covariance) = (Pose2::new(x, 2.0, 0.0), Matrix3::identity() * variance);
        Belief { pose, covariance, twist: Twist::default() }
    }

    #[test]
    fn the_robot_goes_on_by_odometry_until_the_belief_contradicts_or_knows_better() {
        let mut ego = EgoMotion::new(OdometryNoise::default());
        let start = Pose2::new(7.0, 7.0, 1.0);
        let first = ego.expect(start, &belief(1.0, 0.01));
        assert_eq!((first.pose, first.instead_of), (Pose2::new(1.0, 2.0, 0.0), None));
        ego.settle(start, first.pose, Matrix3::identity() * 1e-4);
        let moved = start.compose(Pose2::new(0.1, 0.0, 0.0));
        let near = ego.expect(moved, &belief(1.2, 0.01));
        assert!((near.pose.x - 1.1).abs() < 1e-12 && near.instead_of.is_none(), "{near:?}");
        // 0.1 m further than before, with the heading's variance of 1e-4 and the odometry's of 0.004 m2 per metre.
        assert!((near.covariance[(1, 1)] - (1e-4 + 0.01 * 1e-4 + 0.0004)).abs() < 1e-12, "{near:?}");
        for other in [belief(1.6, 0.01), belief(1.1, 1e-5)] {
            let taken = ego.expect(moved, &other);
            assert_eq!((taken.pose, taken.covariance), (other.pose, other.covariance));
            assert!(taken.instead_of.is_some_and(|from| (from.x - 1.1).abs() < 1e-12), "{taken:?}");
        }
    }
}
