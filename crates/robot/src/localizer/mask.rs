//! Beams that ended on people, which tell nothing about where the robot is.

use curionav_localization::Scan;
use curionav_planning::geometry::Pose2;
use curionav_planning::motion::OdometryNoise;
use curionav_planning::scene::Belief;
use curionav_tracking_people::Detector;

/// Finds the beams of people with the belief before the scan: the tracker needs the belief after it, so it comes too
/// late.
#[derive(Debug)]
pub struct Mask {
    detector: Detector,
    noise: OdometryNoise,
    /// What was believed last.
    belief: Belief,
    /// Where odometry was then; nothing before the first scan and after a restart of the base.
    odometry: Option<Pose2>,
}

impl Mask {
    /// For a robot that begins with this belief.
    pub fn new(detector: Detector, noise: OdometryNoise, belief: Belief) -> Self {
        Self { detector, noise, belief, odometry: None }
    }

    /// The ranges without those of people, whose beams count as free.
    pub fn apply(&self, scan: &Scan<'_>, odometry: Pose2) -> Vec<f32> {
        let motion = self.odometry.map_or_else(Pose2::default, |last| last.relative(odometry));
        let travel = motion.position().distance(Pose2::default().position());
        let pose = self.belief.pose.compose(motion);
        let covariance = self.belief.covariance + self.noise.process_covariance(travel, motion.heading);
        let seen = self.detector.see(scan.ranges, &scan.laser, pose, &covariance);
        let of_people = seen.of_people.into_iter().chain(std::iter::repeat(false));
        scan.ranges
            .iter()
            .zip(of_people)
            .map(|(range, person)| if person { f32::INFINITY } else { *range })
            .collect()
    }

    /// Takes note of what is believed now.
    pub fn believe(&mut self, belief: Belief, odometry: Pose2) {
        self.belief = belief;
        self.odometry = Some(odometry);
    }

    /// The base has started over, and its odometry with it.
    pub fn restart_odometry(&mut self) {
        self.odometry = None;
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use curionav_planning::geometry::Twist;
    use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
    use curionav_planning::sensor::LaserModel;
    use curionav_tracking_people::TrackerParams;
    use nalgebra::Matrix3;

    use super::*;

    #[test]
    fn the_beams_on_a_person_say_nothing_and_those_on_walls_stay() {
        // A wall 3 m ahead of (2, 5), and a person's front 1.5 m ahead.
        let cells = (0..10_000).map(|i| if i % 100 == 50 { 100 } else { 0 }).collect();
        let map = StaticMap::new(OccupancyGrid::new(100, 100, 0.1, Pose2::default(), cells).unwrap());
        let laser = LaserModel::default();
        let ranges: Vec<f32> = (0..181)
            .map(|i| {
                let (s, c) = curionav_planning::numerics::sin_cos(laser.bearing(i));
                let across = 1.75 * s;
                let wall = if c > 0.3 { (3.0 / c).min(5.0) } else { 5.0 };
                let front = 1.75 * c - (0.0625 - across * across).max(0.0).sqrt();
                (if across.abs() < 0.25 && c > 0.0 { front } else { wall }) as f32
            })
            .collect();
        let belief = Belief {
            pose: Pose2::new(2.0, 5.0, 0.0),
            covariance: Matrix3::identity() * 0.01,
            twist: Twist::default(),
        };
        let detector = Detector::new(Arc::new(map), TrackerParams::default());
        let mut mask = Mask::new(detector, OdometryNoise::default(), belief.clone());
        // What is believed holds for where odometry was then: 1 m back, of which nothing else tells.
        mask.believe(Belief { pose: Pose2::new(1.0, 5.0, 0.0), ..belief }, Pose2::new(7.0, 7.0, 0.0));
        let masked = mask.apply(&Scan { ranges: &ranges, laser }, Pose2::new(8.0, 7.0, 0.0));
        let silent: Vec<usize> = (0..181).filter(|i| masked[*i].is_infinite()).collect();
        let person: Vec<usize> = (0..181).filter(|i| ranges[*i] < 1.8).collect();
        assert_eq!(silent, person);
        assert!((0..181).all(|i| masked[i].is_infinite() || masked[i] == ranges[i]));
    }
}
