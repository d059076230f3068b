//! Where the robot believes it is at each scan of a log, by one of three ways.

use std::sync::Arc;

use curionav_localization::{Localizer, Scan};
use curionav_planning::geometry::{Point2, Pose2, Twist};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::scene::Belief;
use curionav_robot::localizer::Mask;
use curionav_tracking_people::{Detector, TrackerParams};
use nalgebra::{Matrix3, Vector3};

use crate::robot_log::Reading;
use crate::robot_log::drive_arguments::{Given, Start};

/// How well a reference is known, metres and radians: map builders are off by about a cell.
const REFERENCE_SIGMA: Vector3<f64> = Vector3::new(0.05, 0.05, 0.01);

/// What tells where the robot is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Way {
    Localizer,
    References,
    Odometry,
}

impl Way {
    /// For a person.
    pub(super) fn words(self) -> &'static str {
        match self {
            Self::Localizer => "the localiser",
            Self::References => "the references",
            Self::Odometry => "odometry alone",
        }
    }

    /// Whether the robot's errors against its references are none by definition.
    pub(super) fn is_the_references(self) -> bool {
        self == Self::References
    }
}

/// Says where the robot is, scan by scan.
pub(super) enum Positioning {
    Localizer(Box<Filtered>),
    References,
    Odometry(DeadReckoning),
}

impl Positioning {
    /// Ready for the first scan. `seed` is that of the particles.
    ///
    /// # Errors
    /// The localiser's parameters cannot be used, or odometry alone is to start anywhere.
    pub(super) fn new(way: Way, given: &Given, tracker: TrackerParams, seed: u64) -> anyhow::Result<Self> {
        Ok(match (way, given.start) {
            (Way::Localizer, _) => Self::Localizer(Box::new(Filtered::new(given, tracker, seed)?)),
            (Way::References, _) => Self::References,
            (Way::Odometry, Start::At(pose)) => {
                let covariance = given.params.start_covariance();
                Self::Odometry(DeadReckoning { noise: given.noise, pose, covariance, last: None })
            }
            (Way::Odometry, Start::Anywhere) => {
                anyhow::bail!("odometry alone does not find a place: give --start in place of --global")
            }
        })
    }

    /// The belief at a scan, or nothing while the place is not known.
    pub(super) fn belief(&mut self, reading: &Reading) -> Option<Belief> {
        match self {
            Self::Localizer(filtered) => filtered.belief(reading),
            Self::References => reading.reference.map(known),
            Self::Odometry(reckoning) => Some(reckoning.belief(reading.odometry)),
        }
    }
}

fn known(pose: Pose2) -> Belief {
    let covariance = Matrix3::from_diagonal(&REFERENCE_SIGMA.component_mul(&REFERENCE_SIGMA));
    Belief { pose, covariance, twist: Twist::default() }
}

/// The localiser, which does not use the beams that end on people, as in the service.
pub(super) struct Filtered {
    localizer: Localizer,
    mask: Mask,
    /// Before, people cannot be told from walls.
    has_converged: bool,
}

impl Filtered {
    fn new(given: &Given, tracker: TrackerParams, seed: u64) -> anyhow::Result<Self> {
        let Given { log, map, noise, params, .. } = given;
        let laser = log.readings[0].laser;
        let start = params.start_covariance();
        let pose = match given.start {
            Start::Anywhere => Pose2::default(),
            Start::At(pose) => pose,
        };
        let localizer = match given.start {
            Start::Anywhere => Localizer::new(map.clone(), laser, *noise, params.clone(), seed)?,
            Start::At(pose) => {
                let at = (pose, &start);
                Localizer::starting_at(map.clone(), laser, *noise, params.clone(), seed, at)?
            }
        };
        let detector = Detector::new(Arc::new(map.clone()), tracker);
        let believed = Belief { pose, covariance: start, twist: Twist::default() };
        let mask = Mask::new(detector, *noise, believed);
        Ok(Self { localizer, mask, has_converged: matches!(given.start, Start::At(_)) })
    }

    fn belief(&mut self, reading: &Reading) -> Option<Belief> {
        let scan = Scan { ranges: &reading.ranges, laser: reading.laser };
        let masked = self.has_converged.then(|| self.mask.apply(&scan, reading.odometry));
        let ranges = masked.as_deref().unwrap_or(&reading.ranges);
        let scan = Scan { ranges, laser: reading.laser };
        let estimate = self.localizer.update(reading.odometry, Twist::default(), reading.stamp, &scan);
        let belief = estimate.belief();
        self.mask.believe(belief.clone(), reading.odometry);
        self.has_converged |= estimate.health.converged;
        self.has_converged.then_some(belief)
    }
}

/// Odometry from a known start on, with the covariance that has grown since.
pub(super) struct DeadReckoning {
    noise: OdometryNoise,
    pose: Pose2,
    covariance: Matrix3<f64>,
    /// Odometry at the scan before.
    last: Option<Pose2>,
}

impl DeadReckoning {
    fn belief(&mut self, odometry: Pose2) -> Belief {
        let moved = self.last.replace(odometry).map_or_else(Pose2::default, |last| last.relative(odometry));
        let pose = self.pose.compose(moved);
        let displacement = Point2::new(pose.x - self.pose.x, pose.y - self.pose.y);
        let travel = moved.position().distance(Point2::default());
        self.covariance = self.noise.propagate(&self.covariance, displacement, travel, moved.heading);
        self.pose = pose;
        Belief { pose, covariance: self.covariance, twist: Twist::default() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn odometry_alone_goes_on_from_its_start_and_is_known_less_and_less() {
        let start = Pose2::new(5.0, 2.0, std::f64::consts::FRAC_PI_2);
        let covariance = Matrix3::identity() * 1e-4;
        let mut reckoning =
            DeadReckoning { noise: OdometryNoise::default(), pose: start, covariance, last: None };
        let first = reckoning.belief(Pose2::new(-7.0, 0.0, 0.0));
        assert_eq!((first.pose, first.covariance), (start, covariance));
        // A metre ahead in the frame of odometry is a metre along y on the map.
        let second = reckoning.belief(Pose2::new(-6.0, 0.0, 0.0));
        assert!(second.pose.position().distance(Point2::new(5.0, 3.0)) < 1e-12, "{second:?}");
        assert!(second.covariance.trace() > first.covariance.trace());
    }
}
