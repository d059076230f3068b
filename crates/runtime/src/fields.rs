//! Fields of a map that evaluators and generators look up instead of computing, kept by what they
//! depend on.

use std::sync::Arc;

use curionav_planning::evaluation::cpc::{InformationField, InformationParams};
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::{GeodesicField, StaticMap};
use curionav_planning::sensor::LaserModel;
use curionav_schemas::{MapId, Reject};
use zenoh::Session;

use crate::map_store::MapStore;
use crate::warm::Kept;

/// Fields kept of each kind: a robot has one goal at a time, a pool serves a few robots.
const FIELDS_KEPT: usize = 8;

/// Room the shortest way keeps from walls beyond the robot's radius, metres: what candidates must keep, and
/// a cell's diagonal.
const GEODESIC_MARGIN: f64 = 0.15;

/// Maps and everything derived from them.
pub struct Fields {
    maps: MapStore,
    geodesic: Kept<(MapId, [u64; 3]), GeodesicField>,
    information: Kept<(MapId, LaserModel, InformationParams), InformationField>,
}

impl Fields {
    /// Nothing is kept yet. Call inside a Tokio runtime.
    pub fn new(session: &Session) -> Self {
        Self {
            maps: MapStore::new(session),
            geodesic: Kept::new(FIELDS_KEPT),
            information: Kept::new(FIELDS_KEPT),
        }
    }

    /// The map itself with its distance fields. Blocks while it is fetched or derived, as do the others.
    pub fn map(&self, id: MapId) -> Result<Arc<StaticMap>, Reject> {
        self.maps.get(id)
    }

    /// Distance to go to `goal` for a robot of `radius` metres that keeps [`GEODESIC_MARGIN`] from walls.
    pub fn geodesic(&self, id: MapId, goal: Point2, radius: f64) -> Result<Arc<GeodesicField>, Reject> {
        let map = self.map(id)?;
        let key = (id, [goal.x, goal.y, radius].map(f64::to_bits));
        self.geodesic.get_or_try(&key, || {
            Ok(GeodesicField::new(&map.grid, &map.to_obstacle, goal, radius + GEODESIC_MARGIN))
        })
    }

    /// Observation information of `laser` everywhere on the map.
    pub fn information(
        &self,
        id: MapId,
        laser: LaserModel,
        params: &InformationParams,
    ) -> Result<Arc<InformationField>, Reject> {
        let map = self.map(id)?;
        let key = (id, laser, params.clone());
        self.information.get_or_try(&key, || Ok(InformationField::new(&map, &laser, params)))
    }
}
