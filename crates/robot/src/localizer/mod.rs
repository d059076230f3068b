//! The localizer: answers odometry and a scan with a belief about the pose.

mod mask;

use std::borrow::Cow;
use std::sync::Arc;

use curionav_localization::{Confidence, Estimate, Localizer, LocalizerParams, Scan as LaserScan};
use curionav_mission::convert;
use curionav_mission::timed::timed;
use curionav_planning::geometry::{Pose2, Twist};
use curionav_planning::motion::OdometryNoise;
use curionav_planning::occupancy::StaticMap;
use curionav_planning::sensor::LaserModel;
use curionav_schemas::{self as wire, Belief, Health, Mission, Odometry, Refusal, Reject, Scan, keys};
use curionav_tracking_people::{Detector, TrackerParams};
use nalgebra::Matrix3;

pub use mask::Mask;

/// Where a robot is when its run begins.
#[derive(Debug, Clone)]
pub struct Start {
    /// Map frame.
    pub pose: Pose2,
    /// Of x, y and heading, m2, m rad and rad2.
    pub covariance: Matrix3<f64>,
    /// Whether it may be elsewhere.
    pub is_doubtful: bool,
    /// Of the particles.
    pub seed: u64,
}

/// Localizes one robot in one run.
pub struct Localization {
    filter: Localizer,
    /// Finds the beams of people, if the mission tracks people; without, the filter tells them from walls as it can.
    mask: Option<Mask>,
}

impl Localization {
    /// Of a robot that begins `mission` on `map`; a second or so passes on a large map.
    ///
    /// # Errors
    /// A parameter is out of its range; the refusal names it.
    pub fn new(mission: &Mission, map: &Arc<StaticMap>) -> Result<Self, Reject> {
        let order = &mission.order;
        convert::check_order(order)?;
        let params: LocalizerParams = convert::parameters("localizer", &order.localizer)?;
        let tracker: TrackerParams = convert::parameters("tracker", &order.tracker_parameters())?;
        let noise = convert::noise(&order.odometry_noise);
        let start = Start {
            pose: convert::pose(order.initial_pose),
            covariance: convert::covariance(&order.initial_covariance),
            is_doubtful: order.initial_doubtful,
            seed: order.seed,
        };
        let mut localization = Self::of(map, convert::laser(&order.laser), noise, params, &start)?;
        if order.requires(keys::TRACKER) {
            let believed = convert::belief(&convert::initial_belief(mission));
            let detector = Detector::new(Arc::clone(map), tracker);
            localization.mask = Some(Mask::new(detector, noise, believed));
        }
        Ok(localization)
    }

    /// Of a robot that begins at `start` on `map`, with every beam taken as it is.
    ///
    /// # Errors
    /// Laser and parameters do not fit together; the refusal says why.
    pub fn of(
        map: &Arc<StaticMap>,
        laser: LaserModel,
        noise: OdometryNoise,
        params: LocalizerParams,
        start: &Start,
    ) -> Result<Self, Reject> {
        let Start { pose, ref covariance, is_doubtful, seed } = *start;
        let map = (**map).clone();
        let filter = timed("the filter", || {
            Localizer::starting_at(map, laser, noise, params, seed, (pose, covariance))
        });
        let mut filter = filter.map_err(|e| Refusal::invalid(e).at("localizer"))?;
        if is_doubtful {
            filter.resume(pose, covariance);
        }
        Ok(Self { filter, mask: None })
    }

    /// Goes on from a pose that was kept, in doubt.
    pub fn resume(&mut self, pose: Pose2) {
        let covariance = self.filter.start_covariance();
        self.filter.resume(pose, &covariance);
    }

    /// The base has started over, and its odometry with it.
    pub fn restart_odometry(&mut self) {
        self.filter.restart_odometry();
        self.mask.iter_mut().for_each(Mask::restart_odometry);
    }

    /// The belief of a tick, and why its scan was not used, if it was not. Without a scan odometry alone tells.
    /// `announced` is the laser of which the mission knows.
    pub fn update(
        &mut self,
        odometry: &Odometry,
        scan: Option<&Scan>,
        announced: LaserModel,
    ) -> (Belief, Option<Reject>) {
        let seen = scan.map_or(Ok((Cow::default(), announced)), |s| convert::scan(s, announced.range_sigma));
        let (seen, unused) = match seen {
            Ok(seen) => (seen, None),
            Err(reject) => ((Cow::default(), announced), Some(reject)),
        };
        let (mut ranges, laser) = seen;
        let pose = Pose2::new(odometry.x, odometry.y, odometry.heading);
        let twist = Twist { v: odometry.v, omega: odometry.omega };
        if let Some(mask) = &self.mask {
            ranges = mask.apply(&LaserScan { ranges: &ranges, laser }, pose).into();
        }
        let estimate = self.filter.update(pose, twist, odometry.stamp, &LaserScan { ranges: &ranges, laser });
        if let Some(mask) = &mut self.mask {
            mask.believe(estimate.belief(), pose);
        }
        (belief(&estimate, odometry), unused)
    }

    /// Poses with their weights.
    pub fn particles(&self) -> impl ExactSizeIterator<Item = (Pose2, f64)> {
        self.filter.particles()
    }
}

fn belief(estimate: &Estimate, odometry: &Odometry) -> Belief {
    let health = Health {
        outside_weight: estimate.health.outside_weight.clamp(0.0, 1.0),
        scan_fit: estimate.health.scan_fit.clamp(0.0, 1.0),
        particles: estimate.health.particles as u32,
        confidence: match estimate.health.confidence {
            Confidence::Sure => wire::Confidence::Sure,
            Confidence::Doubtful => wire::Confidence::Doubtful,
            Confidence::Lost => wire::Confidence::Lost,
        },
    };
    convert::belief_to_wire(&estimate.belief(), odometry.tick, odometry.stamp, health)
}
