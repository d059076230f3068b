//! Fields of a map that evaluators and generators look up instead of computing, kept by what they
//! depend on. The services of one process share them.

use std::sync::Arc;

use curionav_planning::evaluation::cpc::{InformationField, InformationParams};
use curionav_planning::evaluation::information_to_go::InformationToGoField;
use curionav_planning::geometry::Point2;
use curionav_planning::occupancy::{GeodesicField, OccupancyGrid, StaticMap};
use curionav_planning::sensor::LaserModel;
use curionav_planning::terms::{DerivedFields, InformationToGoTermParams, Task};
use curionav_schemas::{MapId, Prepared, Refusal, Reject};
use zenoh::Session;

use crate::cores::Cores;
use crate::map_store::MapStore;
use crate::single_flight_cache::SingleFlightCache;
use crate::telemetry::timed;

/// Distance fields kept: a robot has one goal at a time. On a map of 350 000 cells a distance field is 2.8 MB, so a
/// pool of robots with 32 goals fills 90 MB.
const GEODESIC_KEPT: usize = 32;
/// Information fields kept: robots of one kind on one map share one. On that map a field is at most 13 MB.
const INFORMATION_KEPT: usize = 16;

struct Stock {
    maps: MapStore,
    geodesic: SingleFlightCache<(MapId, [u64; 3]), GeodesicField>,
    information: SingleFlightCache<(MapId, LaserModel, InformationParams), InformationField>,
    information_to_go: SingleFlightCache<(MapId, Task, InformationToGoTermParams), InformationToGoField>,
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
        Self::keeping(MapStore::new(session))
    }

    /// Fields of maps that are here already; none is fetched.
    pub fn of_maps(maps: impl IntoIterator<Item = StaticMap>) -> Self {
        Self::keeping(MapStore::holding(maps))
    }

    fn keeping(maps: MapStore) -> Self {
        let stock = Stock {
            maps,
            geodesic: SingleFlightCache::new(GEODESIC_KEPT),
            information: SingleFlightCache::new(INFORMATION_KEPT),
            information_to_go: SingleFlightCache::new(GEODESIC_KEPT),
        };
        Self { stock: Arc::new(stock), derives: true }
    }

    /// The same fields for work that cannot wait: what is not kept is refused as [`Refusal::Cold`].
    pub fn kept(&self) -> Self {
        Self { stock: Arc::clone(&self.stock), derives: false }
    }

    /// The map of a grid that needs not be fetched.
    pub fn insert(&self, grid: OccupancyGrid) -> Arc<StaticMap> {
        self.stock.maps.insert(grid)
    }

    /// The map itself with its distance fields. Blocks while it is fetched or derived, as do the others.
    pub fn map(&self, id: MapId) -> Result<Arc<StaticMap>, Reject> {
        if self.derives {
            return self.stock.maps.get(id);
        }
        self.stock.maps.kept(id).ok_or_else(|| cold("the map"))
    }

    /// The fields of one map.
    pub fn of(&self, map: MapId) -> FieldsOf<'_> {
        FieldsOf { fields: self, map }
    }

    /// Distances to `goal` on `map` for a robot that keeps `room` metres from walls.
    pub fn way(&self, map: &StaticMap, goal: Point2, room: f64) -> Result<Arc<GeodesicField>, Reject> {
        let key = (MapId(map.grid.hash()), [goal.x, goal.y, room].map(f64::to_bits));
        self.derived("the way to this goal", &self.stock.geodesic, &key, || {
            GeodesicField::new(map, goal, room)
        })
    }

    /// What is kept.
    pub fn prepared(&self) -> Vec<Prepared> {
        let maps = self.stock.maps.ids().into_iter().map(|map| Prepared::Map { map });
        let goals = self.stock.geodesic.keys().into_iter().map(|(map, [x, y, _])| Prepared::Goal {
            map,
            x: f64::from_bits(x),
            y: f64::from_bits(y),
        });
        let sensors = self.stock.information.keys().into_iter().map(|(map, laser, _)| {
            let LaserModel { beams, fov, range_max, .. } = laser;
            Prepared::Sensor { map, beams, fov, range_max }
        });
        maps.chain(goals).chain(sensors).collect()
    }

    fn derived<K: PartialEq + Clone, V>(
        &self,
        what: &str,
        kept: &SingleFlightCache<K, V>,
        key: &K,
        derive: impl FnOnce() -> V,
    ) -> Result<Arc<V>, Reject> {
        if self.derives {
            return kept.get_or_try(key, || Ok(timed(what, derive)));
        }
        kept.get(key).ok_or_else(|| cold(what))
    }
}

/// The fields of one map, each derived once.
pub struct FieldsOf<'a> {
    fields: &'a Fields,
    map: MapId,
}

impl DerivedFields for FieldsOf<'_> {
    type Error = Reject;

    fn map(&self) -> Result<Arc<StaticMap>, Reject> {
        self.fields.map(self.map)
    }

    fn geodesic(&self, goal: Point2, radius: f64) -> Result<Arc<GeodesicField>, Reject> {
        let map = self.map()?;
        self.fields.way(&map, goal, radius + GeodesicField::PLANNING_MARGIN)
    }

    fn information(
        &self,
        laser: LaserModel,
        params: &InformationParams,
    ) -> Result<Arc<InformationField>, Reject> {
        let map = self.map()?;
        let key = (self.map, laser, *params);
        self.fields.derived("what this sensor sees", &self.fields.stock.information, &key, || {
            InformationField::by(&Cores::all(), &map, &laser, params)
        })
    }

    fn information_to_go(
        &self,
        task: &Task,
        params: &InformationToGoTermParams,
    ) -> Result<Arc<InformationToGoField>, Reject> {
        let (map, seen) = (self.map()?, self.information(task.laser, &params.prediction.information)?);
        let key = (self.map, task.clone(), *params);
        self.fields.derived(
            "what uncertainty costs on this way",
            &self.fields.stock.information_to_go,
            &key,
            || params.field(&map, &seen, task),
        )
    }
}

fn cold(what: &str) -> Reject {
    Refusal::Cold { detail: what.to_owned() }.into()
}
