//! The people tracker: answers a belief with the people that the scan of its tick shows.

mod message;

use std::sync::Arc;

use curionav_mission::convert;
use curionav_planning::geometry::Pose2;
use curionav_planning::motion::OdometryNoise;
use curionav_planning::occupancy::StaticMap;
use curionav_schemas::{Belief, MissionOrder, Odometry, People, Reject, Scan};
use curionav_tracking_people::{Observation, Tracker, TrackerParams};

/// Tracks the people around one robot in one run.
pub struct PeopleTracking {
    tracker: Tracker,
    /// Of a person, metres.
    radius: f64,
}

impl PeopleTracking {
    /// Of a robot that carries out `order` on `map`.
    ///
    /// # Errors
    /// A parameter is out of its range; the refusal names it.
    pub fn new(order: &MissionOrder, map: Arc<StaticMap>) -> Result<Self, Reject> {
        convert::check_order(order)?;
        let params: TrackerParams = convert::parameters("tracker", &order.tracker_parameters())?;
        Ok(Self::of(map, params, convert::noise(&order.odometry_noise)))
    }

    /// Of a robot on `map` whose odometry misses as much as `noise` says.
    pub fn of(map: Arc<StaticMap>, params: TrackerParams, noise: OdometryNoise) -> Self {
        Self { tracker: Tracker::new(map, params, noise), radius: params.radius }
    }

    /// The base has started over.
    pub fn restart(&mut self) {
        self.tracker.restart();
    }

    /// The people of a tick, as seen from the robot. A range has a standard deviation of `range_sigma` metres.
    ///
    /// # Errors
    /// The scan describes no scanner.
    pub fn update(
        &mut self,
        odometry: &Odometry,
        scan: &Scan,
        belief: &Belief,
        range_sigma: f64,
    ) -> Result<People, Reject> {
        let (ranges, laser) = convert::scan(scan, range_sigma)?;
        let (people, _) = self.tracker.update(&Observation {
            stamp: odometry.stamp,
            ranges: &ranges,
            laser: &laser,
            odometry: Pose2::new(odometry.x, odometry.y, odometry.heading),
            belief: &convert::belief(belief),
        });
        Ok(message::message(people, odometry, self.radius))
    }
}
