//! The map that scans are held against, and what operators are told of the judgement.

use std::sync::{Arc, Mutex};

use curionav_planning::occupancy::StaticMap;
use curionav_robot::driver::sight::Blind;
use curionav_runtime::fields::Fields;
use curionav_runtime::locked::locked;
use curionav_runtime::metrics::Metrics;
use curionav_schemas::{MapId, Mission};

/// The map of a mission, once it is here.
type OwnMap = Arc<Mutex<Option<(MapId, Arc<StaticMap>)>>>;

/// Whether the laser of one robot is blind, and the map by which that is judged.
pub(crate) struct SightOfMission {
    fields: Fields,
    map: OwnMap,
    /// The judgement on the newest scan.
    blind: Arc<Mutex<Option<Blind>>>,
}

impl SightOfMission {
    pub(crate) fn new(fields: &Fields) -> Self {
        Self { fields: fields.clone(), map: OwnMap::default(), blind: Arc::default() }
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

    /// The map of a mission, if it is here.
    pub(crate) fn map_of(&self, mission: &Mission) -> Option<Arc<StaticMap>> {
        let known = locked(&self.map);
        known.as_ref().filter(|(id, _)| *id == mission.order.map).map(|(_, map)| Arc::clone(map))
    }

    /// Nothing is driven by scans now.
    pub(crate) fn rest(&mut self) {
        *locked(&self.blind) = None;
    }

    /// Takes note of the judgement on a scan.
    pub(crate) fn note(&mut self, blind: Option<Blind>) {
        let mut last = locked(&self.blind);
        if last.as_ref().map(|last| last.reason) != blind.as_ref().map(|blind| blind.reason) {
            match &blind {
                Some(Blind { reason, detail }) => tracing::warn!(reason = reason.code(), detail, "blind"),
                None => tracing::info!("sees again"),
            }
        }
        *last = blind;
    }
}
