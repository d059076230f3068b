//! The driver's eyes: what it needs to judge scans.

use curionav_mission::convert;
use curionav_mission::robot_limits::Base;
use curionav_mission::scanner_limits::ScannerLimits;
use curionav_planning::geometry::Pose2;
use curionav_planning::occupancy::StaticMap;
use curionav_schemas::{Belief, CommandReason, Mission, Odometry, Reject, Scan};

use super::control::pose_of;
use super::seen_way::SeenWay;
use super::sight::{Blind, OnMap, Sight, View};

/// What a tick says about scans.
pub struct Sensed<'a> {
    /// The newest scan, and odometry of its tick.
    pub scan: Option<(&'a Scan, &'a Odometry)>,
    /// The newest belief, and odometry of its tick.
    pub belief: Option<(&'a Belief, &'a Odometry)>,
    /// Why the newest scan was refused, if it was.
    pub refused: Option<Reject>,
    /// The mission's map, if it is here.
    pub map: Option<&'a StaticMap>,
    /// Robot's clock, seconds.
    pub now: f64,
    /// How old a scan may be, seconds.
    pub age_max: f64,
}

/// Judges the scans of one robot.
#[derive(Debug)]
pub struct Lookout {
    /// Those of a real robot; a simulated laser is what its mission says.
    limits: Option<ScannerLimits>,
    sight: Sight,
    seen: SeenWay,
}

impl Lookout {
    /// Of a robot with this base and these limits of its scanner, if they are given.
    pub fn new(base: &Base, limits: Option<ScannerLimits>) -> Self {
        let limits = matches!(base, Base::Real(_)).then(|| limits.unwrap_or_default());
        Self { sight: Sight::new(limits.unwrap_or_default()), limits, seen: SeenWay::default() }
    }

    /// A mission has begun, or goes on to another goal.
    pub fn begin(&mut self, mission: &Mission) {
        let laser = convert::laser(&mission.order.laser);
        self.sight = Sight::new(self.limits.unwrap_or_else(|| ScannerLimits::of_simulated(&laser)));
    }

    /// The clock has begun anew.
    pub fn forget(&mut self) {
        self.seen = SeenWay::default();
    }

    /// Takes in what is sensed; says why the robot, of this radius in metres, has to stand if it sees too little.
    pub fn look(&mut self, sensed: &Sensed<'_>, mission: &Mission, radius: f64) -> Option<Blind> {
        let current = sensed.scan.filter(|(scan, _)| sensed.now - scan.stamp <= sensed.age_max);
        let Some((scan, at_scan)) = current else {
            let reject = sensed.refused.as_ref()?;
            return Some(Blind { reason: CommandReason::BlindRefused, detail: reject.to_string() });
        };
        let on_map = sensed.map.zip(sensed.belief).map(|(map, (belief, at_belief))| OnMap {
            map,
            pose: Pose2::new(belief.x, belief.y, belief.heading)
                .compose(pose_of(at_belief).relative(pose_of(at_scan))),
            position_sigma: (belief.covariance[0] + belief.covariance[4]).max(0.0).sqrt(),
            heading_sigma: belief.covariance[8].max(0.0).sqrt(),
        });
        let view = View { radius, tick_s: mission.order.tick_s, on_map };
        let blind = self.sight.judge(scan, &view);
        if blind.is_none() {
            self.seen.see(scan, at_scan.heading);
        }
        blind
    }

    /// What the laser has seen in the last second.
    pub fn seen(&self) -> &SeenWay {
        &self.seen
    }
}
