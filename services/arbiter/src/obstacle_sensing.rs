//! The streams by which the arbiter sees what is on no map.

use curionav_pool::context::PlanContext;
use curionav_robot::arbiter::obstacle_watch::{Explained, ObstacleWatch};
use curionav_runtime::further_scans::FurtherScans;
use curionav_runtime::lockstep::Latest;
use curionav_schemas::{Belief, Clock, Odometry, People, Scan};

/// Gathers scans and odometry for the watch.
pub(crate) struct ObstacleSensing {
    scans: Latest<Scan>,
    further: FurtherScans,
    odometry: Latest<Odometry>,
    pub(crate) watch: ObstacleWatch,
}

impl ObstacleSensing {
    pub(crate) fn new(scans: Latest<Scan>, further: FurtherScans, odometry: Latest<Odometry>) -> Self {
        Self { scans, further, odometry, watch: ObstacleWatch::default() }
    }

    /// Forgets everything: a run is over, or the base has started over.
    pub(crate) fn forget(&mut self) {
        self.scans.clear();
        self.further.clear();
        self.odometry.clear();
        self.watch.forget();
    }

    /// Takes in the scan of a belief's tick; in real time the newest one, and those of further sensors.
    pub(crate) async fn see(
        &mut self,
        belief: &Belief,
        people: Option<&People>,
        context: &PlanContext,
        clock: Clock,
    ) {
        let Some(scan) = self.scans.of_tick(belief.tick, clock).await.cloned() else { return };
        match clock {
            Clock::Lockstep => self.watch.measured(self.odometry.of_tick(belief.tick, clock).await.cloned()),
            Clock::Realtime => self.watch.measured(self.odometry.drain()),
        }
        let map = &context.course.map;
        let range_sigma = context.mission.order.laser.range_sigma;
        self.watch.see(scan, self.further.newest(), &Explained { belief, people, map, range_sigma });
    }
}
