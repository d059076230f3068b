//! Where the robot is, as Nav2's own localisation says: the transform from map to odometry, and how sure it is.

use curionav_planning::geometry::{Pose2, Twist};
use curionav_ros2::messages as ros;
use curionav_schemas::{Belief, Confidence, F64Array, Health};

use crate::fault::Fault;
use crate::frames::planar;
use crate::order::Start;
use crate::robot_clock::Sample;

/// A transform whose stamp lies farther behind the robot's clock says nothing of where the robot is, seconds. AMCL and
/// slam_toolbox stamp theirs ahead of each scan, by up to a second.
const AGE_MAX: f64 = 1.0;
/// Standard deviations of a pose of which nothing says how sure it is, as of slam_toolbox: m, m, rad.
const SIGMA: [f64; 3] = [0.05, 0.05, 0.03];

/// What has been heard of Nav2's localisation.
#[derive(Debug, Default)]
pub(crate) struct Nav2Pose {
    /// The pose of odometry's origin in the map, and the transform's stamp.
    map_from_odom: Option<(Pose2, ros::Time)>,
    covariance: Option<F64Array>,
}

impl Nav2Pose {
    /// Takes note of the transform from `map` to `odom`, if a message has it.
    ///
    /// # Errors
    /// If it does not lie in the plane.
    pub(crate) fn transforms(&mut self, said: &ros::TfMessage, map: &str, odom: &str) -> Result<(), Fault> {
        let is_it = |one: &&ros::TransformStamped| one.header.frame_id == map && one.child_frame_id == odom;
        let Some(one) = said.transforms.iter().rfind(is_it) else { return Ok(()) };
        let ros::Vector3 { x, y, z } = one.transform.translation;
        let pose = ros::Pose { position: ros::Point { x, y, z }, orientation: one.transform.rotation };
        self.map_from_odom = Some((planar(&pose)?, one.header.stamp));
        Ok(())
    }

    /// Takes note of how sure localisation is (`amcl_pose`).
    ///
    /// # Errors
    /// If its covariance is none.
    pub(crate) fn pose(&mut self, said: &ros::PoseWithCovarianceStamped) -> Result<(), Fault> {
        self.covariance = Some(Start::said(said)?.covariance);
        Ok(())
    }

    /// Nothing of what was heard is of use: the clock has begun anew.
    pub(crate) fn forget(&mut self) {
        *self = Self::default();
    }

    /// Where the robot is at a sample of odometry, if the transform is not too old. `seconds` gives stamps as the
    /// robot's clock has them.
    pub(crate) fn belief(
        &self,
        sample: &Sample,
        seconds: impl Fn(ros::Time) -> Option<f64>,
    ) -> Option<Belief> {
        let (map_from_odom, stamp) = self.map_from_odom?;
        if sample.stamp - seconds(stamp)? > AGE_MAX {
            return None;
        }
        let Pose2 { x, y, heading } = map_from_odom.compose(sample.pose);
        let Twist { v, omega } = sample.twist;
        let covariance = self.covariance.clone().unwrap_or_else(unsaid);
        // Nav2 says nothing of how well scans fit.
        let confidence = Confidence::Sure;
        let health = Health { outside_weight: 0.0, scan_fit: 1.0, particles: 0, confidence };
        Some(Belief { tick: sample.tick, stamp: sample.stamp, x, y, heading, covariance, v, omega, health })
    }
}

fn unsaid() -> F64Array {
    let mut covariance = vec![0.0; 9];
    SIGMA.iter().enumerate().for_each(|(i, sigma)| covariance[4 * i] = sigma * sigma);
    covariance.into()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::drawing;

    fn said(parent: &str, child: &str, at: Pose2, sec: i32) -> ros::TfMessage {
        drawing::transform(drawing::header(ros::Time { sec, nanosec: 0 }, parent), child, at)
    }

    fn sample(stamp: f64) -> Sample {
        let pose = Pose2::new(1.0, 0.0, 0.0);
        Sample { tick: 7, stamp, pose, twist: Twist { v: 0.5, omega: 0.1 } }
    }

    fn seconds(stamp: ros::Time) -> Option<f64> {
        Some(stamp.seconds())
    }

    #[test]
    fn the_pose_is_that_of_odometry_seen_from_the_map() {
        let mut pose = Nav2Pose::default();
        assert_eq!(pose.belief(&sample(10.0), seconds), None);
        let quarter = std::f64::consts::FRAC_PI_2;
        pose.transforms(&said("map", "base", Pose2::new(9.0, 9.0, 0.0), 10), "map", "odom").unwrap();
        assert_eq!(pose.belief(&sample(10.0), seconds), None, "it is another transform");
        pose.transforms(&said("map", "odom", Pose2::new(2.0, 3.0, quarter), 10), "map", "odom").unwrap();
        let belief = pose.belief(&sample(10.0), seconds).unwrap();
        assert!((belief.x - 2.0).hypot(belief.y - 4.0) < 1e-9 && (belief.heading - quarter).abs() < 1e-9);
        assert_eq!((belief.tick, belief.v), (7, 0.5));
        assert!((belief.covariance[0] - 0.0025).abs() < 1e-12);
    }

    #[test]
    fn an_old_transform_says_nothing_and_one_ahead_does() {
        let mut pose = Nav2Pose::default();
        pose.transforms(&said("map", "odom", Pose2::default(), 10), "map", "odom").unwrap();
        assert!(
            pose.belief(&sample(10.9), seconds).is_some() && pose.belief(&sample(9.2), seconds).is_some()
        );
        assert_eq!(pose.belief(&sample(11.1), seconds), None);
        pose.forget();
        assert_eq!(pose.belief(&sample(10.0), seconds), None);
    }

    #[test]
    fn amcl_says_how_sure_it_is() {
        let mut pose = Nav2Pose::default();
        pose.transforms(&said("map", "odom", Pose2::default(), 10), "map", "odom").unwrap();
        let mut amcl = ros::PoseWithCovarianceStamped {
            pose: ros::PoseWithCovariance { pose: drawing::pose(Pose2::default()), ..Default::default() },
            ..Default::default()
        };
        amcl.pose.covariance[5][5] = 0.25;
        pose.pose(&amcl).unwrap();
        assert_eq!(pose.belief(&sample(10.0), seconds).unwrap().covariance[8], 0.25);
        amcl.pose.covariance[0][0] = -1.0;
        assert!(pose.pose(&amcl).is_err());
    }
}
