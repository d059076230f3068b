//! Fields of a map that evaluators and generators look up instead of computing, kept by what they
//! depend on.

use std::sync::Arc;

use curionav_planning::evaluation::cpc::{InformationField, InformationParams};
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::{GeodesicField, StaticMap};
use curionav_planning::sensor::LaserModel;
use curionav_schemas::{MapId, Reject, RejectCode};
use zenoh::Session;

use crate::map_store::MapStore;
use crate::warm::Kept;

/// Fields kept of each kind: a robot has one goal at a time. On a map of 350 000 cells a distance field
/// is 2.8 MB, so a pool of robots with 32 goals fills 90 MB.
const FIELDS_KEPT: usize = 32;

/// Room the shortest way keeps from walls beyond the robot's radius, metres: what candidates must keep, and
/// a cell's diagonal.
const GEODESIC_MARGIN: f64 = 0.15;

struct Stock {
    maps: MapStore,
    geodesic: Kept<(MapId, [u64; 3]), GeodesicField>,
    information: Kept<(MapId, LaserModel, InformationParams), InformationField>,
}

/// Maps and everything derived from them. Clones share what is kept.
#[derive(Clone)]
pub struct Fields {
    stock: Arc<Stock>,
    derives: bool,
}

impl Fields {
    /// Nothing is kept yet. Call inside a Tokio runtime.
    pub fn new(session: &Session) -> Self {
        Self::from(MapStore::new(session))
    }

    /// Fields of maps that are here already; none is fetched.
    pub fn of_maps(maps: impl IntoIterator<Item = StaticMap>) -> Self {
        Self::from(MapStore::holding(maps))
    }

    /// The same fields for work that cannot wait: what is not kept is refused as [`RejectCode::Cold`].
    pub fn kept(&self) -> Self {
        Self { stock: Arc::clone(&self.stock), derives: false }
    }

    /// The map itself with its distance fields. Blocks while it is fetched or derived, as do the others.
    pub fn map(&self, id: MapId) -> Result<Arc<StaticMap>, Reject> {
        if self.derives {
            return self.stock.maps.get(id);
        }
        self.stock.maps.kept(id).ok_or_else(|| cold("the map"))
    }

    /// Distance to go to `goal` for a robot of `radius` metres that keeps [`GEODESIC_MARGIN`] from walls.
    pub fn geodesic(&self, id: MapId, goal: Point2, radius: f64) -> Result<Arc<GeodesicField>, Reject> {
        let map = self.map(id)?;
        let key = (id, [goal.x, goal.y, radius].map(f64::to_bits));
        self.derived("the way to this goal", &self.stock.geodesic, &key, || {
            GeodesicField::new(&map.grid, &map.to_obstacle, goal, radius + GEODESIC_MARGIN)
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
        let key = (id, laser, *params);
        self.derived("what this sensor sees", &self.stock.information, &key, || {
            InformationField::new(&map, &laser, params)
        })
    }

    /// What is kept, a line each.
    pub fn warmed(&self) -> Vec<String> {
        let maps = self.stock.maps.ids().into_iter().map(|id| format!("map {id}"));
        let goals =
            self.stock.geodesic.keys().into_iter().map(|(id, [x, y, _])| {
                format!("goal {:.2} {:.2} on {id}", f64::from_bits(x), f64::from_bits(y))
            });
        let sensors = self.stock.information.keys().into_iter().map(|(id, laser, _)| {
            let LaserModel { beams, fov, range_max, .. } = laser;
            format!("sensor {beams} over {fov:.2} rad to {range_max:.2} m on {id}")
        });
        maps.chain(goals).chain(sensors).collect()
    }

    fn derived<K: PartialEq + Clone, V>(
        &self,
        what: &str,
        kept: &Kept<K, V>,
        key: &K,
        derive: impl FnOnce() -> V,
    ) -> Result<Arc<V>, Reject> {
        if self.derives {
            return kept.get_or_try(key, || Ok(derive()));
        }
        kept.get(key).ok_or_else(|| cold(what))
    }
}

impl From<MapStore> for Fields {
    fn from(maps: MapStore) -> Self {
        let (geodesic, information) = (Kept::new(FIELDS_KEPT), Kept::new(FIELDS_KEPT));
        Self { stock: Arc::new(Stock { maps, geodesic, information }), derives: true }
    }
}

fn cold(what: &str) -> Reject {
    Reject::new(RejectCode::Cold, format!("{what} is not prepared here; ask for nothing first"))
}
