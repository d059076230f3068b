//! The static world: occupancy grid, its map_server files, and the fields derived from it.

mod distance_transform;
mod geodesic;
mod grid;
mod map_server;
mod map_yaml;
mod static_map;

pub use distance_transform::DistanceField;
pub use geodesic::GeodesicField;
pub use grid::{Cell, GridError, MapHash, OccupancyGrid};
pub use map_server::{MapServerError, encode_pgm, load_map};
pub use map_yaml::{MapMode, MapYaml};
pub use static_map::StaticMap;
