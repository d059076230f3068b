//! Maps over a session: hosted where they are, fetched by every process that needs them.

use std::time::Duration;

use curionav_planning::occupancy::OccupancyGrid;
use curionav_schemas::{self as wire, MapId, Refusal, keys};
use zenoh::Session;

use crate::convert;
use crate::fields::Fields;
use crate::metrics::Tally;
use crate::query::{AskError, fetch_known};
use crate::serve::{ServeError, Server, serve_state};
use curionav_mission::map_store::MapSource;

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

/// Fields of maps that are fetched over `session`; nothing is kept yet. Call inside a Tokio runtime.
pub fn fields(session: &Session) -> Fields {
    Fields::new(Box::new(Hosted { session: session.clone(), runtime: tokio::runtime::Handle::current() }))
}

/// The maps that are hosted where a session reaches.
struct Hosted {
    session: Session,
    runtime: tokio::runtime::Handle,
}

impl MapSource for Hosted {
    fn fetch(&self, id: MapId) -> Result<OccupancyGrid, String> {
        self.runtime.block_on(fetch(&self.session, id, FETCH_TIMEOUT)).map_err(|error| error.to_string())
    }
}
