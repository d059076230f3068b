//! Maps by content: hosted where they are, fetched once by every process that needs them.

use std::convert::Infallible;
use std::sync::Arc;
use std::time::Duration;

use curionav_planning::occupancy::{OccupancyGrid, StaticMap};
use curionav_schemas::{self as wire, MapId, Refusal, Reject, keys};
use zenoh::Session;

use crate::convert;
use crate::cores::Cores;
use crate::metrics::Tally;
use crate::query::{AskError, fetch_known};
use crate::serve::{ServeError, Server, serve_state};
use crate::single_flight_cache::SingleFlightCache;
use crate::telemetry::timed;

/// Bytes of maps kept by one process, with their distance fields: a robot works on one or two at a time, and a map of
/// 350 000 cells has 3 MB.
const MAPS_BYTES: usize = 128 << 20;
/// A large map over a slow link.
const FETCH_TIMEOUT: Duration = Duration::from_secs(20);

/// Serves one map on its key for as long as the server lives; what is refused is added to `refused`.
pub fn host(session: &Session, map: wire::OccupancyGrid, refused: &Tally) -> Result<Server, ServeError> {
    let key = keys::map(&map.map);
    serve_state(session, &key, refused, move || Ok(map.clone()))
}

/// Map `id`; what else is served under its key is passed over.
pub async fn fetch(session: &Session, id: MapId, timeout: Duration) -> Result<OccupancyGrid, AskError> {
    let accept = |served: wire::OccupancyGrid| {
        let grid = convert::occupancy_grid(served)?;
        if grid.hash() == id.0 { Ok(grid) } else { Err(Refusal::WrongMap.at("map")) }
    };
    fetch_known(session, &keys::map(&id), timeout, accept).await
}

fn static_map(grid: OccupancyGrid) -> StaticMap {
    timed("distances to walls", || StaticMap::by(&Cores::all(), grid))
}

/// Fetches maps on a miss and keeps them with their distance fields.
pub struct MapStore {
    /// Where a missing map is asked for.
    source: Option<(Session, tokio::runtime::Handle)>,
    maps: SingleFlightCache<MapId, StaticMap>,
}

impl MapStore {
    /// An empty store. Call inside a Tokio runtime.
    pub fn new(session: &Session) -> Self {
        let source = (session.clone(), tokio::runtime::Handle::current());
        Self { source: Some(source), maps: SingleFlightCache::new(MAPS_BYTES, StaticMap::bytes) }
    }

    /// A store of these maps, the last of them if they are too large for all, without a source of others.
    pub fn holding(maps: impl IntoIterator<Item = StaticMap>) -> Self {
        let store = Self { source: None, maps: SingleFlightCache::new(MAPS_BYTES, StaticMap::bytes) };
        for map in maps {
            let id = MapId(map.grid.hash());
            let _: Result<_, Infallible> = store.maps.get_or_try(&id, || Ok(map));
        }
        store
    }

    /// The map of this grid, which is here already.
    pub fn insert(&self, grid: OccupancyGrid) -> Arc<StaticMap> {
        let id = MapId(grid.hash());
        let Ok(map) = self.maps.get_or_try(&id, || Ok::<_, Infallible>(static_map(grid)));
        map
    }

    /// The maps kept.
    pub fn ids(&self) -> Vec<MapId> {
        self.maps.keys()
    }

    /// The map with this identity if it is kept.
    pub fn kept(&self, id: MapId) -> Option<Arc<StaticMap>> {
        self.maps.get(&id)
    }

    /// The map with this identity. Blocks while it is fetched: call from a thread that may block.
    pub fn get(&self, id: MapId) -> Result<Arc<StaticMap>, Reject> {
        self.maps.get_or_try(&id, || {
            let missing = |detail: String| Reject::from(Refusal::NoMap { detail });
            let Some((session, runtime)) = &self.source else {
                return Err(missing("this process does not fetch maps".into()));
            };
            let fetched = runtime.block_on(fetch(session, id, FETCH_TIMEOUT));
            Ok(static_map(fetched.map_err(|e| missing(e.to_string()))?))
        })
    }
}
