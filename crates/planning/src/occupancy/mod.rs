//! The static world: occupancy grid, its map_server files, and the fields derived from it.

mod distance_transform;
mod front;
mod geodesic;
mod grid;
#[cfg(feature = "map-files")]
mod map_server;
#[cfg(feature = "map-files")]
mod map_yaml;
mod ray_cast;
mod static_map;

pub use distance_transform::DistanceField;
pub(crate) use front::Front;
pub use geodesic::GeodesicField;
pub use geodesic::detour::Detour;
pub use grid::{Cell, GridError, OccupancyGrid};
#[cfg(feature = "map-files")]
pub use map_server::{encode_pgm, load_map};
#[cfg(feature = "map-files")]
pub use map_yaml::{MapMode, MapServerError, MapYaml};
pub use ray_cast::{Hit, RayCaster};
pub use static_map::StaticMap;
