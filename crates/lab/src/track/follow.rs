//! A log driven through localiser and tracker.

use std::sync::Arc;
use std::time::Instant;

use curionav_planning::geometry::{Point2, Pose2};
use curionav_planning::sensor::LaserModel;
use curionav_tracking_people::{Observation, Person, Tracker, TrackerParams};

use super::positioning::{Positioning, Way};
use crate::robot_log::drive_arguments::Given;

/// A log, and what drives it.
pub(super) struct Drive {
    pub(super) given: Given,
    pub(super) way: Way,
    /// Those of the tracker.
    pub(super) params: TrackerParams,
    /// Of the localiser's particles.
    pub(super) seed: u64,
}

/// The people that the tracker follows at one scan.
pub(super) struct Scanned {
    /// Seconds on the log's clock.
    pub(super) stamp: f64,
    pub(super) laser: LaserModel,
    /// Where the robot believes it is on the map; nothing while it does not know.
    pub(super) pose: Option<Pose2>,
    /// In the frame of the robot, with those who are hidden now; none while the place is not known.
    pub(super) people: Vec<Person>,
}

impl Scanned {
    /// The place on the map of something in the robot's frame.
    pub(super) fn on_map(&self, place: Point2) -> Option<Point2> {
        self.pose.map(|pose| pose.transform(place))
    }

    /// The place in the laser's frame of something in the robot's.
    pub(super) fn in_laser(&self, place: Point2) -> Point2 {
        self.laser.robot_from_laser.inverse_transform(place)
    }
}

/// What came of a log.
pub(super) struct Course {
    /// One per reading of the log.
    pub(super) scans: Vec<Scanned>,
    /// Seconds of wall time that all of it took.
    pub(super) wall_s: f64,
}

impl Course {
    /// Drives the log as the services do, scan by scan: the place first, then the people. `progress` is told how many
    /// readings are done.
    ///
    /// # Errors
    /// See [`Positioning::new`].
    pub(super) fn of(drive: &Drive, mut progress: impl FnMut(usize)) -> anyhow::Result<Self> {
        let Drive { given, way, params, seed } = drive;
        let began = Instant::now();
        let mut positioning = Positioning::new(*way, given, *params, *seed)?;
        let mut tracker = Tracker::new(Arc::new(given.map.clone()), *params, given.noise);
        let mut scans = Vec::with_capacity(given.log.readings.len());
        for reading in &given.log.delayed(given.delay_s).readings {
            let belief = positioning.belief(reading);
            let people = belief.as_ref().map_or_else(Vec::new, |belief| {
                let now = Observation {
                    stamp: reading.stamp,
                    ranges: &reading.ranges,
                    laser: &reading.laser,
                    odometry: reading.odometry,
                    belief,
                };
                tracker.update(&now).0
            });
            let pose = belief.map(|belief| belief.pose);
            scans.push(Scanned { stamp: reading.stamp, laser: reading.laser, pose, people });
            progress(scans.len());
        }
        Ok(Self { scans, wall_s: began.elapsed().as_secs_f64() })
    }
}
