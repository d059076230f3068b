//! Maps by content: hosted by whoever has them, fetched once by whoever needs them.

use std::sync::Arc;
use std::time::Duration;

use curionav_planning::occupancy::StaticMap;
use curionav_schemas::{self as wire, MapId, Reject, RejectCode, keys};
use zenoh::Session;

use crate::convert;
use crate::query::fetch;
use crate::serve::{ServeError, Server, serve_state};
use crate::warm::Kept;

/// Maps kept by one process: a robot works on one or two at a time.
const MAPS_KEPT: usize = 4;
/// A large map over a slow link.
const FETCH_TIMEOUT: Duration = Duration::from_secs(20);

/// Serves one map on its key for as long as the server lives.
pub fn host(session: &Session, map: wire::OccupancyGrid) -> Result<Server, ServeError> {
    let key = keys::map(&map.map);
    serve_state(session, &key, move || Ok(map.clone()))
}

/// Fetches maps on a miss and keeps them with their distance fields.
pub struct MapStore {
    session: Session,
    runtime: tokio::runtime::Handle,
    maps: Kept<MapId, StaticMap>,
}

impl MapStore {
    /// An empty store. Call inside a Tokio runtime.
    pub fn new(session: &Session) -> Self {
        Self {
            session: session.clone(),
            runtime: tokio::runtime::Handle::current(),
            maps: Kept::new(MAPS_KEPT),
        }
    }

    /// The map with this identity. Blocks while it is fetched: call from a thread that may block.
    pub fn get(&self, id: MapId) -> Result<Arc<StaticMap>, Reject> {
        self.maps.get_or_try(&id, || {
            let grid: wire::OccupancyGrid = self
                .runtime
                .block_on(fetch(&self.session, &keys::map(&id), FETCH_TIMEOUT))
                .map_err(|e| Reject::new(RejectCode::Cold, &format!("map {id} could not be fetched: {e}")))?;
            let grid = convert::occupancy_grid(grid)?;
            if grid.hash().0 != id.0 {
                return Err(Reject::new(
                    RejectCode::Invalid,
                    &format!("what was served as map {id} is another map"),
                ));
            }
            Ok(StaticMap::new(grid))
        })
    }
}
