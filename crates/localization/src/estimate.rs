//! What the localiser answers.

use nalgebra::Matrix3;

use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::scene::Belief;

use crate::confidence::Confidence;

/// How far the estimate can be trusted, beyond its covariance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Health {
    /// The probability that the robot is not where the estimate is, 0 to 1: the weight of other clusters, of the
    /// likeliest other place that is followed, and of all others as far as scans that do not fit tell of them.
    /// It is 1 while the estimate is carried on by odometry because all clusters would be a jump.
    pub outside_weight: f64,
    /// Of the beams that people cannot explain (those that end near a mapped obstacle or would have to
    /// pass through one), the share that agrees with the estimate: of the latest scan with such beams,
    /// 1 before the first. A crowd does not lower it, a wrong pose does.
    pub scan_fit: f64,
    /// Number of particles.
    pub particles: usize,
    /// Whether the position is known to `converged_sigma`, surely.
    pub converged: bool,
    /// Whether a robot may act on the estimate.
    pub confidence: Confidence,
}

impl Health {
    /// That of so many particles all over the map.
    pub(crate) fn without_estimate(particles: usize) -> Self {
        let confidence = Confidence::Lost;
        Self { outside_weight: 1.0, scan_fit: 1.0, particles, converged: false, confidence }
    }
}

/// The answer to one tick.
#[derive(Debug, Clone, PartialEq)]
pub struct Estimate {
    /// Mean of the heaviest cluster that does not need a jump to be reached, map frame.
    pub pose: Pose2,
    /// Covariance of (x, y, heading) about the pose: m2, m rad, rad2. It is that of the same cluster, and of all places
    /// where the robot may be while more than 5 % of the weight lies outside of the cluster.
    pub covariance: Matrix3<f64>,
    /// Speed and turn rate as odometry measured them.
    pub twist: Twist,
    /// Trust.
    pub health: Health,
    /// Whether the filter took in a scan at this tick, or only moved its last estimate along.
    pub observed: bool,
}

impl Estimate {
    /// What the planner needs of it.
    pub fn belief(&self) -> Belief {
        Belief { pose: self.pose, covariance: self.covariance, twist: self.twist }
    }
}
