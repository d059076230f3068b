//! The driver's eyes: what it needs to judge scans, and its judgement for operators.

use std::sync::{Arc, Mutex};

use curionav_planning::geometry::Pose2;
use curionav_planning::occupancy::StaticMap;
use curionav_runtime::convert;
use curionav_runtime::fields::Fields;
use curionav_runtime::locked::locked;
use curionav_runtime::metrics::Metrics;
use curionav_runtime::robot_limits::Base;
use curionav_runtime::scanner_limits::ScannerLimits;
use curionav_schemas::{Belief, CommandReason, MapId, Mission, Odometry, Reject, Scan};

use crate::control::pose_of;
use crate::seen_way::SeenWay;
use crate::sight::{Blind, OnMap, Sight, View};

/// The map of a mission, once it is here.
type OwnMap = Arc<Mutex<Option<(MapId, Arc<StaticMap>)>>>;

/// What a tick says about scans.
pub(crate) struct Sensed<'a> {
    /// The newest scan, and odometry of its tick.
    pub(crate) scan: Option<(&'a Scan, &'a Odometry)>,
    /// The newest belief, and odometry of its tick.
    pub(crate) belief: Option<(&'a Belief, &'a Odometry)>,
    /// Why the newest scan was refused, if it was.
    pub(crate) refused: Option<Reject>,
    /// Robot's clock, seconds.
    pub(crate) now: f64,
    /// How old a scan may be, seconds.
    pub(crate) age_max: f64,
}

/// Judges the scans of one robot.
pub(crate) struct Lookout {
    /// Those of a real robot; a simulated laser is what its mission says.
    limits: Option<ScannerLimits>,
    fields: Fields,
    map: OwnMap,
    sight: Sight,
    seen: SeenWay,
    /// The judgement on the newest scan.
    blind: Arc<Mutex<Option<Blind>>>,
}

impl Lookout {
    /// Of a robot with this base and these limits of its scanner, if they are given.
    pub(crate) fn new(base: &Base, limits: Option<ScannerLimits>, fields: &Fields) -> Self {
        let limits = matches!(base, Base::Real(_)).then(|| limits.unwrap_or_default());
        Self {
            sight: Sight::new(limits.unwrap_or_default()),
            limits,
            fields: fields.clone(),
            map: OwnMap::default(),
            seen: SeenWay::default(),
            blind: Arc::default(),
        }
    }

    /// Says to operators why the laser counts as blind.
    pub(crate) fn register(&self, metrics: &mut Metrics) {
        let blind = Arc::clone(&self.blind);
        let help = "Always 1; the labels say why the robot stands as if blind, and the numbers";
        metrics.gauges_by("blind", help, &["reason", "detail"], move || {
            let blind = locked(&blind);
            blind.iter().map(|b| (vec![b.reason.code().to_owned(), b.detail.clone()], 1.0)).collect()
        });
    }

    /// A mission has begun, or goes on to another goal. Its map is fetched aside: until it is here, scans are not
    /// held against it.
    pub(crate) fn begin(&mut self, mission: &Mission) {
        let laser = convert::laser(&mission.order.laser);
        self.sight = Sight::new(self.limits.unwrap_or_else(|| ScannerLimits::of_simulated(&laser)));
        let id = mission.order.map;
        if locked(&self.map).as_ref().is_some_and(|(known, _)| *known == id) {
            return;
        }
        let fields = self.fields.clone();
        let slot = Arc::clone(&self.map);
        tokio::task::spawn_blocking(move || match fields.map(id) {
            Ok(map) => *locked(&slot) = Some((id, map)),
            Err(reject) => tracing::warn!(%reject, "no map to hold scans against"),
        });
    }

    /// Nothing is driven by scans now.
    pub(crate) fn rest(&mut self) {
        *locked(&self.blind) = None;
    }

    /// The clock has begun anew.
    pub(crate) fn forget(&mut self) {
        self.seen = SeenWay::default();
        self.rest();
    }

    /// Takes in what is sensed; says why the robot has to stand, if it sees too little.
    pub(crate) fn look(
        &mut self,
        sensed: &Sensed<'_>,
        mission: &Mission,
        radius: f64,
    ) -> Option<CommandReason> {
        let blind = self.judge(sensed, mission, radius);
        let reason = blind.as_ref().map(|blind| blind.reason);
        let mut last = locked(&self.blind);
        if last.as_ref().map(|last| last.reason) != reason {
            match &blind {
                Some(Blind { reason, detail }) => tracing::warn!(reason = reason.code(), detail, "blind"),
                None => tracing::info!("sees again"),
            }
        }
        *last = blind;
        reason
    }

    fn judge(&mut self, sensed: &Sensed<'_>, mission: &Mission, radius: f64) -> Option<Blind> {
        let current = sensed.scan.filter(|(scan, _)| sensed.now - scan.stamp <= sensed.age_max);
        let Some((scan, at_scan)) = current else {
            let reject = sensed.refused.as_ref()?;
            return Some(Blind { reason: CommandReason::BlindRefused, detail: reject.to_string() });
        };
        let map = locked(&self.map).clone().filter(|(id, _)| *id == mission.order.map);
        let on_map = map.as_ref().zip(sensed.belief).map(|((_, map), (belief, at_belief))| OnMap {
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
    pub(crate) fn seen(&self) -> &SeenWay {
        &self.seen
    }
}
