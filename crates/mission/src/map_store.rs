//! Maps by content, kept with their distance fields.

use std::convert::Infallible;
use std::sync::Arc;

use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_schemas::{MapId, Refusal, Reject};

use crate::cores::Cores;
use crate::single_flight_cache::SingleFlightCache;
use crate::timed::timed;

/// Bytes of maps kept by one process, with their distance fields: a robot works on one or two at a time, and a map of
/// 350 000 cells has 3 MB.
const MAPS_BYTES: usize = 128 << 20;

/// Where a map that is not here comes from.
pub trait MapSource: Send + Sync {
    /// The map with this identity. Blocks until it is here.
    ///
    /// # Errors
    /// In words why it cannot be had.
    fn fetch(&self, id: MapId) -> Result<OccupancyGrid, String>;
}

fn static_map(grid: OccupancyGrid) -> StaticMap {
    timed("distances to walls", || StaticMap::by(&Cores::all(), grid))
}

/// Fetches maps on a miss and keeps them with their distance fields.
pub(crate) struct MapStore {
    source: Option<Box<dyn MapSource>>,
    maps: SingleFlightCache<MapId, StaticMap>,
}

impl MapStore {
    /// An empty store, which asks `source` for what it has not.
    pub(crate) fn new(source: Box<dyn MapSource>) -> Self {
        Self { source: Some(source), maps: SingleFlightCache::new(MAPS_BYTES, StaticMap::bytes) }
    }

    /// A store of these maps, the last of them if they are too large for all, without a source of others.
    pub(crate) fn holding(maps: impl IntoIterator<Item = StaticMap>) -> Self {
        let store = Self { source: None, maps: SingleFlightCache::new(MAPS_BYTES, StaticMap::bytes) };
        for map in maps {
            let id = MapId(map.grid.hash());
            let _: Result<_, Infallible> = store.maps.get_or_try(&id, || Ok(map));
        }
        store
    }

    /// The map of this grid, which is here already.
    pub(crate) fn insert(&self, grid: OccupancyGrid) -> Arc<StaticMap> {
        let id = MapId(grid.hash());
        let Ok(map) = self.maps.get_or_try(&id, || Ok::<_, Infallible>(static_map(grid)));
        map
    }

    /// The maps kept.
    pub(crate) fn ids(&self) -> Vec<MapId> {
        self.maps.keys()
    }

    /// The map with this identity if it is kept.
    pub(crate) fn kept(&self, id: MapId) -> Option<Arc<StaticMap>> {
        self.maps.get(&id)
    }

    /// The map with this identity. Blocks while it is fetched: call from a thread that may block.
    pub(crate) fn get(&self, id: MapId) -> Result<Arc<StaticMap>, Reject> {
        self.maps.get_or_try(&id, || {
            let missing = |detail: String| Reject::from(Refusal::NoMap { detail });
            let Some(source) = &self.source else {
                return Err(missing("this process does not fetch maps".into()));
            };
            Ok(static_map(source.fetch(id).map_err(missing)?))
        })
    }
}
